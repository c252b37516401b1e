#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "common/config/scenario.hpp"
#include "common/sync/time.hpp"
#include "sim_server/core/participants/roster.hpp"
#include "sim_server/core/step/plant_side.hpp"
#include "sim_server/core/step/vehicle.hpp"

namespace sls::sim {

/// The vehicles of a run, step by step.
class Fleet {
 public:
  /// The vehicles `ids` (ascending) of `scenario`.
  /// @throws config::ConfigError if a plant cannot be made.
  Fleet(const config::Scenario& scenario, const std::vector<std::uint32_t>& ids,
        std::uint64_t run_id, PlantSide::ForEach for_each);

  const std::vector<std::uint32_t>& ids() const { return ids_; }
  const std::vector<std::unique_ptr<Vehicle>>& vehicles() const { return vehicles_; }
  /// The vehicle `id`; null if this server does not fly it.
  Vehicle* find(std::uint32_t id) const;
  /// The plant of the first vehicle.
  const Plant& plant() const { return plants_.plant(); }

  /// The step in work.
  std::uint64_t step() const { return step_; }
  /// Measures the state of step 0.
  void begin() { plants_.begin(); }
  /// Flies the period that begins with the step in work, and goes on to the next step. Every
  /// vehicle is settled.
  /// @throws std::runtime_error if a plant fails.
  void advance();
  /// The records of the step in work, as ids().
  const std::vector<model::StepRecord>& records() const { return plants_.records(); }

  /// Awaits the answers to the step in work.
  void expect_answers();
  bool are_all_accepted() const;
  bool are_all_settled() const;
  /// True if a vehicle's last step was flown without an answer, and none has come since.
  bool is_anybody_absent() const;
  /// True if the outcome of the step in work ends every mission. A vehicle whose mission is over
  /// flies on until all are over.
  bool is_finished() const;
  /// Takes the accepted answers.
  void take_answers();

  void set_clients(const Roster& roster, const std::string& scenario_sha256);
  void note_rest(sync::Duration rest);
  double calc_longest_absence_s(sync::Time now) const;

  /// Remarks of the plants on their vehicles since the last call.
  std::vector<std::string> take_remarks() { return plants_.take_remarks(); }
  /// " (vehicles 0-3)" in a fleet.
  std::string describe(const std::vector<std::uint32_t>& ids) const;
  /// The refused answers of a vehicle; empty if none is refused.
  std::string describe_refusals(const Vehicle& vehicle) const;

 private:
  const std::vector<std::uint32_t> ids_;
  PlantSide plants_;
  std::vector<std::unique_ptr<Vehicle>> vehicles_;  // as ids_
  std::uint64_t step_ = 0;
};

}  // namespace sls::sim
