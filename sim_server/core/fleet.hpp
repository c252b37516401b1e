#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "common/config/scenario.hpp"
#include "common/sync/time.hpp"
#include "sim_server/core/roster.hpp"
#include "sim_server/core/vehicle.hpp"
#include "sim_server/plants/plant.hpp"

namespace sls::sim {

/// The vehicles of a run and the plants that move them, step by step.
class Fleet {
 public:
  /// Calls `work(i)` once for each i below `count` and returns when all are done, as
  /// WorkerPool::for_each does.
  using ForEach =
      std::function<void(std::size_t count, const std::function<void(std::size_t)>& work)>;

  /// The vehicles `ids` (ascending) of `scenario`. `for_each` moves independent plants.
  /// @throws config::ConfigError if a plant cannot be made.
  Fleet(const config::Scenario& scenario, const std::vector<std::uint32_t>& ids,
        std::uint64_t run_id, ForEach for_each);

  const std::vector<std::uint32_t>& ids() const { return ids_; }
  const std::vector<std::unique_ptr<Vehicle>>& vehicles() const { return vehicles_; }
  /// The vehicle `id`; null if this server does not fly it.
  Vehicle* find(std::uint32_t id) const;
  /// The plant of the first vehicle.
  const Plant& plant() const { return *plants_.front().plant; }

  /// The step in work.
  std::uint64_t step() const { return step_; }
  /// Measures the state of step 0.
  void begin();
  /// Flies the period that begins with the step in work, and goes on to the next step. Every
  /// vehicle is settled.
  /// @throws std::runtime_error if a plant fails.
  void advance();

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
  std::vector<std::string> take_remarks();
  /// " (vehicles 0-3)" in a fleet.
  std::string describe(const std::vector<std::uint32_t>& ids) const;
  /// The refused answers of a vehicle; empty if none is refused.
  std::string describe_refusals(const Vehicle& vehicle) const;

 private:
  void measure(const PlantOfVehicles& group);
  void advance(PlantOfVehicles& group);

  const std::vector<std::uint32_t> ids_;
  const ForEach for_each_;
  const bool is_alone_;             // in its scenario
  const std::int64_t plant_steps_;  // per period
  std::vector<PlantOfVehicles> plants_;
  std::vector<std::unique_ptr<Vehicle>> vehicles_;  // as ids_
  std::uint64_t step_ = 0;
};

}  // namespace sls::sim
