#include "sim_server/core/fleet.hpp"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <stdexcept>
#include <utility>

#include "common/config/vehicle_ids.hpp"

namespace sls::sim {

Fleet::Fleet(const config::Scenario& scenario, const std::vector<std::uint32_t>& ids,
             std::uint64_t run_id, ForEach for_each)
    : ids_(ids),
      for_each_(std::move(for_each)),
      is_alone_(scenario.vehicles.size() == 1),
      plant_steps_(scenario.sync.period_ns / scenario.plant.step_ns),
      plants_(make_plants(find_plant_type(scenario.plant.model), scenario, ids)) {
  for (const std::uint32_t id : ids)
    vehicles_.push_back(std::make_unique<Vehicle>(scenario, id, run_id));
}

Vehicle* Fleet::find(std::uint32_t id) const {
  const auto found = std::lower_bound(ids_.begin(), ids_.end(), id);
  if (found == ids_.end() || *found != id) return nullptr;
  return vehicles_[static_cast<std::size_t>(found - ids_.begin())].get();
}

void Fleet::begin() {
  for (const PlantOfVehicles& group : plants_) measure(group);
}

void Fleet::advance() {
  ++step_;
  for_each_(plants_.size(), [this](std::size_t i) { advance(plants_[i]); });
}

void Fleet::advance(PlantOfVehicles& group) {
  group.forces.clear();
  for (const std::size_t i : group.vehicles) group.forces.push_back(vehicles_[i]->actuate());
  try {
    group.plant->advance(group.forces, plant_steps_);
  } catch (const std::exception& error) {
    if (is_alone_) throw;
    throw std::runtime_error(
        fmt::format("vehicle {}: {}", ids_[group.vehicles.front()], error.what()));
  }
  measure(group);
}

void Fleet::measure(const PlantOfVehicles& group) {
  const Plant& plant = *group.plant;
  for (std::size_t i = 0; i < group.vehicles.size(); ++i)
    vehicles_[group.vehicles[i]]->measure(step_, plant.measurement(i),
                                          plant.sees_truth() ? nullptr : &plant.seen(i));
}

void Fleet::expect_answers() {
  for (const auto& vehicle : vehicles_) vehicle->gate.expect(step_);
}

bool Fleet::are_all_accepted() const {
  return std::all_of(vehicles_.begin(), vehicles_.end(),
                     [](const auto& vehicle) { return vehicle->gate.accepted().has_value(); });
}

bool Fleet::are_all_settled() const {
  return std::all_of(vehicles_.begin(), vehicles_.end(),
                     [](const auto& vehicle) { return vehicle->is_settled(); });
}

bool Fleet::is_anybody_absent() const {
  return std::any_of(vehicles_.begin(), vehicles_.end(),
                     [](const auto& vehicle) { return vehicle->absence.is_acting(); });
}

bool Fleet::is_finished() const {
  return std::all_of(vehicles_.begin(), vehicles_.end(),
                     [](const auto& vehicle) { return vehicle->is_finished(); });
}

void Fleet::take_answers() {
  for (const auto& vehicle : vehicles_)
    if (!vehicle->is_settled() && vehicle->gate.accepted()) vehicle->take_answer();
}

void Fleet::set_clients(const Roster& roster, const std::string& scenario_sha256) {
  for (const auto& vehicle : vehicles_)
    vehicle->gate.set_clients(find_ready_clients(roster, scenario_sha256, vehicle->id()));
}

void Fleet::note_rest(sync::Duration rest) {
  for (const auto& vehicle : vehicles_) vehicle->note_rest(rest);
}

double Fleet::calc_longest_absence_s(sync::Time now) const {
  double longest = 0.0;
  for (const auto& vehicle : vehicles_) longest = std::max(longest, vehicle->calc_absence_s(now));
  return longest;
}

std::vector<std::string> Fleet::take_remarks() {
  std::vector<std::string> remarks;
  for (const PlantOfVehicles& group : plants_)
    for (std::size_t i = 0; i < group.vehicles.size(); ++i)
      for (const std::string& remark : group.plant->take_remarks(i))
        remarks.push_back(fmt::format("vehicle {}: {}", ids_[group.vehicles[i]], remark));
  return remarks;
}

std::string Fleet::describe(const std::vector<std::uint32_t>& ids) const {
  if (vehicles_.size() == 1) return "";
  return fmt::format(" (vehicle{} {})", ids.size() > 1 ? "s" : "", config::to_vehicle_ranges(ids));
}

std::string Fleet::describe_refusals(const Vehicle& vehicle) const {
  const std::string refusals = vehicle.gate.describe_refusals();
  return vehicles_.size() == 1 || refusals.empty()
             ? refusals
             : fmt::format("vehicle {}: {}", vehicle.id(), refusals);
}

}  // namespace sls::sim
