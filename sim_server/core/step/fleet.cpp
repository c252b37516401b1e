#include "sim_server/core/step/fleet.hpp"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <utility>

#include "common/config/vehicle_ids.hpp"

namespace sls::sim {

Fleet::Fleet(const config::Scenario& scenario, const std::vector<std::uint32_t>& ids,
             std::uint64_t run_id, PlantSide::ForEach for_each)
    : ids_(ids), plants_(scenario, ids, std::move(for_each)) {
  for (model::StepRecord& record : plants_.records())
    vehicles_.push_back(std::make_unique<Vehicle>(scenario, run_id, record));
}

Vehicle* Fleet::find(std::uint32_t id) const {
  const auto found = std::lower_bound(ids_.begin(), ids_.end(), id);
  if (found == ids_.end() || *found != id) return nullptr;
  return vehicles_[static_cast<std::size_t>(found - ids_.begin())].get();
}

void Fleet::advance() {
  ++step_;
  plants_.advance();
  for (const auto& vehicle : vehicles_) vehicle->begin_step();
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
                     [](const auto& vehicle) { return vehicle->is_absent(); });
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
