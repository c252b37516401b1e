#include "sim_server/core/step/plant_side.hpp"

#include <spdlog/fmt/fmt.h>

#include <stdexcept>
#include <utility>

namespace sls::sim {

PlantSide::PlantSide(const config::Scenario& scenario, const std::vector<std::uint32_t>& ids,
                     ForEach for_each)
    : for_each_(std::move(for_each)),
      is_fleet_(scenario.vehicles.size() > 1),
      plant_steps_(scenario.sync.period_ns / scenario.plant.step_ns),
      plants_(make_plants(find_plant_type(scenario.plant.model), scenario, ids)),
      records_(ids.size()) {
  for (std::size_t i = 0; i < ids.size(); ++i) {
    faults_.emplace_back(config::make_vehicle_scenario(scenario, ids[i]), ids[i]);
    records_[i].vehicle_id = ids[i];
  }
}

void PlantSide::begin() {
  for (const PlantOfVehicles& group : plants_) measure(group);
}

void PlantSide::advance() {
  for_each_(plants_.size(), [this](std::size_t i) { advance(plants_[i]); });
}

void PlantSide::advance(PlantOfVehicles& group) {
  group.forces.clear();
  for (const std::size_t i : group.vehicles) {
    model::StepRecord& record = records_[i];
    record.f_Q_W = faults_[i].actuate(record.step, record.answer.f_Q_W);
    group.forces.push_back(record.f_Q_W);
  }
  try {
    group.plant->advance(group.forces, plant_steps_);
  } catch (const std::exception& error) {
    if (!is_fleet_) throw;
    throw std::runtime_error(
        fmt::format("vehicle {}: {}", records_[group.vehicles.front()].vehicle_id, error.what()));
  }
  for (const std::size_t i : group.vehicles) ++records_[i].step;
  measure(group);
}

void PlantSide::measure(const PlantOfVehicles& group) {
  const Plant& plant = *group.plant;
  for (std::size_t i = 0; i < group.vehicles.size(); ++i) {
    FaultLine& faults = faults_[group.vehicles[i]];
    model::StepRecord& record = records_[group.vehicles[i]];
    record.truth = plant.measurement(i);
    if (faults.can_disturb_state() || !plant.sees_truth())
      record.measured = faults.measure(record.step, plant.seen(i));
  }
}

std::vector<std::string> PlantSide::take_remarks() {
  std::vector<std::string> remarks;
  for (const PlantOfVehicles& group : plants_)
    for (std::size_t i = 0; i < group.vehicles.size(); ++i)
      for (const std::string& remark : group.plant->take_remarks(i))
        remarks.push_back(
            fmt::format("vehicle {}: {}", records_[group.vehicles[i]].vehicle_id, remark));
  return remarks;
}

}  // namespace sls::sim
