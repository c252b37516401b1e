#include <cmath>
#include <map>
#include <numeric>
#include <set>
#include <stdexcept>

#include "common/config/vehicle_ids.hpp"
#include "sim_server/plants/plant.hpp"
#include "sim_server/plants/sensing/sensed_plant.hpp"
#include "sim_server/plants/thrust/thrust_source.hpp"

namespace sls::sim {

#define SLS_PLANT(name) PlantType name##_type();
#include "sim_server/plants/plants.def"
#undef SLS_PLANT
PlantType shared_library_plant_type();

const PlantType& find_plant_type(const config::ModelName& model) {
  static const std::map<std::string, PlantType> registry{
#define SLS_PLANT(name) {#name, name##_type()},
#include "sim_server/plants/plants.def"
#undef SLS_PLANT
  };
  static const PlantType shared_library = shared_library_plant_type();
  if (model.is_shared_library()) return shared_library;
  const auto found = registry.find(model.name);
  if (found == registry.end())
    throw config::ConfigError("plant.model: expected " + config::list_models(registry) + ", got " +
                              model.name);
  return found->second;
}

const std::vector<std::string>& list_reserved_signal_names() {
  static const std::vector<std::string> names = {
      "vehicle_id", "step",         "sim_time_s",      "quad_x_m",       "quad_y_m",
      "quad_z_m",   "quad_vx_m_s",  "quad_vy_m_s",     "quad_vz_m_s",    "load_x_m",
      "load_y_m",   "load_z_m",     "load_vx_m_s",     "load_vy_m_s",    "load_vz_m_s",
      "alpha_rad",  "beta_rad",     "alpha_dot_rad_s", "beta_dot_rad_s", "force_x_n",
      "force_y_n",  "force_z_n",    "att_w",           "att_x",          "att_y",
      "att_z",      "rate_x_rad_s", "rate_y_rad_s",    "rate_z_rad_s"};
  return names;
}

namespace {

/// Checks the limits of sls/parameters and state.csv.
void check_signals(const std::vector<Signal>& signals, const config::ModelName& model) {
  constexpr std::size_t kMostLettersOfName = 32, kMostLettersOfUnit = 16;
  std::set<std::string> taken(list_reserved_signal_names().begin(),
                              list_reserved_signal_names().end());
  for (const Signal& signal : signals) {
    const std::string place = model.describe_place("plant.model") + ": signal '" + signal.name +
                              "' of '" + model.name + "': ";
    if (!taken.insert(signal.name).second)
      throw config::ConfigError(place + "expected a name that no other column has, got this one");
    if (signal.name.size() > kMostLettersOfName || signal.unit.size() > kMostLettersOfUnit)
      throw config::ConfigError(place + "expected at most " + std::to_string(kMostLettersOfName) +
                                " letters and " + std::to_string(kMostLettersOfUnit) +
                                " of its unit, got " + std::to_string(signal.name.size()) +
                                " and " + std::to_string(signal.unit.size()));
  }
}

PlantSetup::Vehicle make_setup_of(const config::Scenario& alone, std::uint32_t id) {
  return {id, alone.vehicle, alone.plant.initial, alone.plant.thrust.scale};
}

/// A plant that moves `vehicles`.
std::unique_ptr<Plant> make_plant_of(const PlantType& type, const config::Scenario& scenario,
                                     const std::vector<PlantSetup::Vehicle>& vehicles) {
  PlantSetup setup;
  setup.plant = scenario.plant;
  setup.autopilot = scenario.autopilot.value_or(config::Autopilot());
  setup.folder = scenario.folder;
  setup.estimator = scenario.estimator;
  setup.vehicles = vehicles;
  setup.lacks_thrust = count_thrust_signals(scenario) > 0;
  auto plant = make_sensed(make_tired(type.make(setup), setup), setup, scenario);
  check_signals(plant->signals(), scenario.plant.model);
  return plant;
}

}  // namespace

std::unique_ptr<Plant> make_plant(const PlantType& type, const config::Scenario& alone,
                                  std::uint32_t id) {
  return make_plant_of(type, alone, {make_setup_of(alone, id)});
}

std::vector<PlantOfVehicles> make_plants(const PlantType& type, const config::Scenario& fleet,
                                         const std::vector<std::uint32_t>& ids) {
  std::vector<PlantSetup::Vehicle> vehicles;
  for (const std::uint32_t id : ids) {
    vehicles.push_back(make_setup_of(config::make_vehicle_scenario(fleet, id), id));
  }
  std::vector<PlantOfVehicles> plants;
  if (type.moves == Moves::kAllVehicles) {
    if (ids.size() != fleet.vehicles.size())
      throw config::ConfigError("plant.model: expected a server of all " +
                                std::to_string(fleet.vehicles.size()) + " vehicles, which '" +
                                fleet.plant.model.name + "' moves together, got one of " +
                                config::to_vehicle_ranges(ids));
    plants.push_back(
        {make_plant_of(type, fleet, vehicles), std::vector<std::size_t>(ids.size()), {}});
    std::iota(plants[0].vehicles.begin(), plants[0].vehicles.end(), 0);
    return plants;
  }
  for (std::size_t i = 0; i < ids.size(); ++i)
    plants.push_back({make_plant_of(type, fleet, {vehicles[i]}), {i}, {}});
  return plants;
}

void throw_not_finite(const std::string& quantity, std::int64_t step) {
  throw std::runtime_error(quantity + " is not finite after step " + std::to_string(step) +
                           " of the plant");
}

void check_finite(const Eigen::Vector3d& v, std::int64_t step, const char* x, const char* y,
                  const char* z) {
  if (!std::isfinite(v.x())) throw_not_finite(x, step);
  if (!std::isfinite(v.y())) throw_not_finite(y, step);
  if (!std::isfinite(v.z())) throw_not_finite(z, step);
}

void check_finite(const model::SlungLoadState& state, std::int64_t step) {
  if (model::is_finite(state)) return;
  check_finite(state.p_WQ, step, "quad_x_m", "quad_y_m", "quad_z_m");
  check_finite(state.v_WQ, step, "quad_vx_m_s", "quad_vy_m_s", "quad_vz_m_s");
  check_finite(state.p_WL, step, "load_x_m", "load_y_m", "load_z_m");
  check_finite(state.v_WL, step, "load_vx_m_s", "load_vy_m_s", "load_vz_m_s");
  if (!std::isfinite(state.rod.alpha)) throw_not_finite("alpha_rad", step);
  if (!std::isfinite(state.rod.beta)) throw_not_finite("beta_rad", step);
  if (!std::isfinite(state.rod.alpha_dot)) throw_not_finite("alpha_dot_rad_s", step);
  throw_not_finite("beta_dot_rad_s", step);
}

}  // namespace sls::sim
