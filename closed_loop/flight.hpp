/// The closed loop in one process and one thread: plants, faults, missions, controllers and the
/// judgement of their answers, without DDS. A flight has the same bits as a recording of the
/// programs in lockstep.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "common/config/scenario.hpp"
#include "common/model/step_record.hpp"
#include "control_client/flight_controller.hpp"
#include "control_client/laws/control_law.hpp"
#include "sim_server/core/answers/judgement.hpp"
#include "sim_server/core/step/plant_side.hpp"

namespace sls::closed_loop {

struct FlightOptions {
  std::string controller_name = "control_client";  ///< in messages
  bool checks_purity = false;                      ///< as of FlightController
  bool measures_compute_time = false;
  control::LawMaker make_law = &control::make_control_law;
};

/// The ids of all vehicles of `scenario`.
std::vector<std::uint32_t> list_vehicles(const config::Scenario& scenario);

class Flight {
 public:
  /// Begins at step 0, with the vehicles `ids` (ascending) of `scenario`, whose period is the one
  /// in force.
  /// @throws config::ConfigError as plant and controller do.
  Flight(const config::Scenario& scenario, const std::vector<std::uint32_t>& ids,
         const FlightOptions& options = {});
  /// A flight of one vehicle.
  explicit Flight(const config::Scenario& scenario, std::uint32_t vehicle = 0)
      : Flight(scenario, std::vector<std::uint32_t>{vehicle}) {}

  /// Flies the next step of all vehicles; the last step is the one whose answers end the flight.
  /// Returns the step of the first vehicle; `steps` has those of all. Null after the end.
  const model::StepRecord* fly_step();

  /// The last step of every vehicle, in the order of the ids. The one whose answer failed the
  /// flight is of the kind kRefused.
  const std::vector<model::StepRecord>& steps() const { return plants_.records(); }

  /// True if a broken law ended the flight: it threw, or gave different answers to equal inputs.
  bool is_law_broken() const { return is_law_broken_; }

  /// The plant of the first vehicle.
  const sim::Plant& plant() const { return plants_.plant(); }

  /// Remarks of the plants on their vehicles since the last call.
  std::vector<std::string> take_remarks() { return plants_.take_remarks(); }

  /// After the end: why the flight failed; empty if every mission was finished.
  const std::string& failure() const { return failure_; }

 private:
  void answer();
  /// True if the answers end the flight, judged as the server does.
  bool is_last();

  const std::string controller_name_;
  const bool measures_compute_time_;
  const sim::AnswerLimits limits_;
  const bool is_fleet_;
  sim::PlantSide plants_;
  std::vector<control::FlightController> controllers_;
  bool has_begun_ = false;
  bool has_ended_ = false;
  bool is_law_broken_ = false;
  std::string failure_;
};

/// All steps of a flight of one vehicle of `scenario`.
std::vector<model::StepRecord> fly(const config::Scenario& scenario, std::uint32_t vehicle = 0);

}  // namespace sls::closed_loop
