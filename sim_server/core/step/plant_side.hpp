/// The plant side of the loop: what lies between the answers of controllers and the measurements
/// that they answer. The only step: server and closed loop share it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "common/config/scenario.hpp"
#include "common/model/step_record.hpp"
#include "sim_server/core/step/fault_line.hpp"
#include "sim_server/plants/plant.hpp"

namespace sls::sim {

/// PlantSide::ForEach in one thread.
inline void one_after_another(std::size_t count, const std::function<void(std::size_t)>& work) {
  for (std::size_t i = 0; i < count; ++i) work(i);
}

class PlantSide {
 public:
  /// Calls `work(i)` once for each i below `count` and returns when all are done, as
  /// WorkerPool::for_each does.
  using ForEach =
      std::function<void(std::size_t count, const std::function<void(std::size_t)>& work)>;

  /// The vehicles `ids` (ascending) of `scenario`, before step 0. `for_each` moves independent
  /// plants.
  /// @throws config::ConfigError if a plant cannot be made.
  PlantSide(const config::Scenario& scenario, const std::vector<std::uint32_t>& ids,
            ForEach for_each);

  /// Measures the states of step 0.
  void begin();
  /// Applies the answers of the step in work, which must be known, moves the plants over the
  /// control period and measures the states of the next step.
  /// @throws std::runtime_error if a plant fails; its vehicles' states are then those before.
  void advance();

  /// The records of the step in work, in the order of the ids. Their answers are those of the step
  /// before until the caller writes the new ones; advance() applies them.
  std::vector<model::StepRecord>& records() { return records_; }
  const std::vector<model::StepRecord>& records() const { return records_; }

  /// The plant of the first vehicle.
  const Plant& plant() const { return *plants_.front().plant; }
  /// Remarks of the plants on their vehicles since the last call.
  std::vector<std::string> take_remarks();

 private:
  void measure(const PlantOfVehicles& group);
  void advance(PlantOfVehicles& group);

  const ForEach for_each_;
  const bool is_fleet_;
  const std::int64_t plant_steps_;  // per period
  std::vector<PlantOfVehicles> plants_;
  std::vector<FaultLine> faults_;           // of each vehicle
  std::vector<model::StepRecord> records_;  // likewise
};

}  // namespace sls::sim
