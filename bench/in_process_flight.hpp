/// The closed loop in one process, with the classes the programs use and neither DDS nor a clock: a
/// flight is bit for bit what the distributed run in lockstep records.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "common/config/scenario.hpp"
#include "common/model/state.hpp"
#include "control_client/flight_controller.hpp"
#include "sim_server/fault_line.hpp"
#include "sim_server/slung_load_plant.hpp"

namespace sls::bench {

/// One control period: what was true, what was measured, what was answered.
struct FlownStep {
  std::uint64_t step = 0;
  model::SlungLoadState truth;
  model::SlungLoadState measured;  ///< with the faults on `state`: what the controller answered
  Eigen::Vector3d applied_f_Q_W = Eigen::Vector3d::Zero();  ///< over [step − 1, step), N; 0 at 0
  control::Answer answer;
};

class InProcessFlight {
 public:
  /// At step 0 of vehicle `vehicle` of `scenario`, whose period is the one in force.
  /// @throws config::ConfigError as plant and controller do.
  explicit InProcessFlight(const config::Scenario& scenario, std::uint32_t vehicle = 0);

  /// The next step, up to the one whose answer ends the flight; then nothing.
  std::optional<FlownStep> fly_step();

  /// Why the flight failed, once it has ended; empty if the mission was finished.
  const std::string& failure() const { return failure_; }

 private:
  /// Moves the plant over the period after `step_`. False, with the failure, if it cannot.
  bool apply(const Eigen::Vector3d& f_Q_W);
  /// Whether the answer ends the flight, judged as the server does.
  bool is_last(const control::Answer& answer);

  config::Scenario scenario_;  // of the vehicle alone
  std::int64_t steps_per_period_;
  double force_limit_;
  sim::SlungLoadPlant plant_;
  sim::FaultLine faults_;
  control::FlightController controller_;
  std::uint64_t step_ = 0;
  control::ControllerMemory memory_;
  Eigen::Vector3d applied_f_Q_W_ = Eigen::Vector3d::Zero();
  std::optional<Eigen::Vector3d> meant_f_Q_W_;  // answered to the step before
  bool has_ended_ = false;
  std::string failure_;
};

/// All steps of a flight of one vehicle of `scenario`.
std::vector<FlownStep> fly(const config::Scenario& scenario, std::uint32_t vehicle = 0);

}  // namespace sls::bench
