/// Many loops of one scenario at once: the caller gives the forces, or takes those of the
/// scenario's law. For learning and optimisation. Each loop has the same bits as a Flight whose
/// controllers return these forces, for any number of loops and threads.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/config/scenario.hpp"
#include "common/model/measurement.hpp"
#include "common/model/reference.hpp"
#include "control_client/flight_controller.hpp"
#include "control_client/mission.hpp"
#include "sim_server/core/answers/judgement.hpp"
#include "sim_server/core/step/fault_line.hpp"
#include "sim_server/plants/plant.hpp"
#include "sim_server/worker_pool.hpp"

namespace sls::closed_loop {

/// The states of all loops, a row for each vehicle of each loop: SI, radians, in W.
struct LoopStates {
  using Vectors = Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor>;
  using Pairs = Eigen::Matrix<double, Eigen::Dynamic, 2, Eigen::RowMajor>;
  using Quaternions = Eigen::Matrix<double, Eigen::Dynamic, 4, Eigen::RowMajor>;

  Vectors quad_position, quad_velocity, load_position, load_velocity;
  Pairs angles, angle_rates;  ///< (alpha, beta) of the rod
  Quaternions attitude;       ///< (w, x, y, z) of q_WB; no rows for plants without attitude
  Vectors body_rates;         ///< w_WB_B; no rows for plants without attitude
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> signals;  ///< of the plant
};

/// Start of a loop.
struct LoopStart {
  config::InitialState initial;
  std::uint64_t seed_shift = 0;  ///< added to each seed of the scenario's faults
};

struct BatchOptions {
  std::uint32_t vehicle = 0;               ///< of the scenario's fleet; 0 where it moves together
  std::size_t threads = 1;                 ///< share the work of a step; includes the caller's
  std::string controller_name = "python";  ///< in the texts of `failure`
};

class Batch {
 public:
  /// `count` ≥ 1 loops at step 0 of `scenario`, whose period is the one in force.
  /// A plant that moves the whole fleet together does so in each loop.
  /// @throws config::ConfigError as the plant does.
  Batch(const config::Scenario& scenario, std::size_t count, const BatchOptions& options = {});

  std::size_t count() const { return loops_.size(); }
  std::size_t vehicles() const { return ids_.size(); }  ///< of a loop
  /// The scenario of the one vehicle, or of all that move together.
  const config::Scenario& scenario() const { return scenario_; }
  /// The scenario of the vehicle `index` of a loop alone.
  const config::Scenario& own(std::size_t index) const { return own_[index]; }
  const std::vector<sim::Signal>& signals() const { return signals_; }
  /// True if the measured state can differ from the truth.
  bool can_measurement_differ() const { return can_measurement_differ_; }

  /// Resets the loops `which` to step 0, each with its element of `starts`. If it throws, no loop
  /// is reset.
  /// @throws config::ConfigError as the plant does, or for an attitude if the plant has none.
  void reset(const std::vector<std::size_t>& which, const std::vector<LoopStart>& starts);

  /// Moves each loop by one period, with the rows of `forces` (count × vehicles × 3, N, in W) of
  /// its vehicles held constant. A loop fails if the server would refuse a force or if its plant
  /// throws; its state then stays the same until its reset.
  void step(const double* forces);

  /// Writes the forces that the scenario's law answers to the measured states (as step() takes
  /// them). A loop of whose answers the server would refuse one fails; its forces are 0. The law
  /// remembers its last answer: call it in every step. In one thread.
  /// @throws config::ConfigError if the law refuses the scenario.
  void answer(double* forces);

  const LoopStates& truth() const { return truth_; }
  /// The states after sensors, estimator and faults: the input of controllers.
  const LoopStates& measured() const { return can_measurement_differ_ ? measured_ : truth_; }

  // One entry for each loop.
  const std::vector<std::uint64_t>& steps() const { return steps_; }
  const std::vector<double>& times() const { return times_; }              ///< s
  const std::vector<std::uint8_t>& has_failed() const { return failed_; }  ///< 0 or 1
  /// Reason of the failure, one line; empty if the loop has not failed.
  const std::string& failure(std::size_t loop) const { return loops_[loop].failure; }

  /// The mission's reference of a vehicle `time_ns` after step 0. A stage with a duration ends at
  /// its time. A stage that ends by a condition has no known end, so it counts as the last one.
  model::Reference calc_reference(std::int64_t time_ns, std::size_t vehicle = 0) const;

 private:
  struct Loop {
    std::unique_ptr<sim::Plant> plant;
    std::vector<sim::FaultLine> faults;       // of each vehicle
    std::vector<Eigen::Vector3d> forces;      // applied; a member to avoid allocation
    std::vector<model::Measurement> seen;     // if the measured state can differ
    std::vector<model::Answer> answers;       // of the law; empty: it was not asked
    std::optional<std::uint64_t> answered{};  // the step of them
    std::string failure{};
  };

  std::vector<config::Scenario> make_own(const config::Scenario& scenario) const;
  Loop make_loop(const LoopStart& start) const;
  void answer(std::size_t index, const sim::AnswerLimits& limits);
  /// Fails the loop and returns false if the server would refuse the answer of a vehicle.
  bool accepts(std::size_t index, std::size_t vehicle, const model::Answer& answer,
               const sim::AnswerLimits& limits);
  void move(std::size_t index, const double* forces);
  /// Copies the states of loop `index` into its rows of truth_ and measured_.
  void show(std::size_t index);
  void fail(std::size_t index, const std::string& reason);

  const bool moves_together_;
  const std::vector<std::uint32_t> ids_;  // of the vehicles of each loop
  config::Scenario scenario_;
  const std::vector<config::Scenario> own_;  // of each vehicle
  const std::string controller_name_;
  const std::int64_t steps_per_period_;
  bool has_attitude_ = false;
  bool has_state_faults_ = false;
  bool can_measurement_differ_ = false;
  std::vector<sim::Signal> signals_;
  std::vector<std::int64_t> stage_starts_ns_;
  std::vector<control::Mission> missions_;              // of each vehicle
  std::vector<control::FlightController> controllers_;  // likewise; made when the law is asked
  std::vector<Loop> loops_;
  LoopStates truth_, measured_;
  std::vector<std::uint64_t> steps_;
  std::vector<double> times_;
  std::vector<std::uint8_t> failed_;
  sim::WorkerPool pool_;
};

}  // namespace sls::closed_loop
