#include "sim_server/plants/cables/keys.hpp"

#include "common/config/own_keys.hpp"
#include "sim_server/plants/cables/start.hpp"
#include "sim_server/plants/inertia.hpp"

namespace sls::sim {
namespace {

std::string show(const Eigen::Vector3d& v) {
  return "[" + config::to_text(v.x()) + ", " + config::to_text(v.y()) + ", " +
         config::to_text(v.z()) + "]";
}

class CablesOwnKeys : public config::OwnKeys<config::Plant, CablesKeys> {
  void check(const config::Scenario& scenario, const config::Places& places) const override {
    const auto& keys = scenario.plant.own.get<CablesKeys>();
    const std::size_t count = scenario.vehicles.size();
    if (count > cables::kMaxCables)
      throw places.make_error_at("vehicles", "expected at most " +
                                                 std::to_string(cables::kMaxCables) +
                                                 " on one load, got " + std::to_string(count));
    const std::string defect = find_count_defect(keys, count);
    if (!defect.empty()) throw places.make_error_at("plant.cables", defect);
    check_load(keys, places);
    check_start(keys, scenario, places);
  }

  std::optional<model::SharedLoad> calc_shared_load(
      const config::Scenario& scenario) const override {
    const auto& keys = scenario.plant.own.get<CablesKeys>();
    model::SharedLoad load;
    if (keys.load_inertia) load.inertia_L = make_inertia(*keys.load_inertia, keys.load_products);
    load.q_WL = keys.load_attitude.value_or(load.q_WL);
    for (std::size_t i = 0; i < scenario.vehicles.size(); ++i)
      load.cables.push_back(
          {scenario.vehicles[i].load_mass.value_or(scenario.vehicle.load_mass),
           keys.cables.empty() ? Eigen::Vector3d(0.0, 0.0, 0.0) : keys.cables[i].attachment});
    return load;
  }

  static void check_load(const CablesKeys& keys, const config::Places& places) {
    if (keys.load_inertia) {
      const std::string defect =
          find_free_inertia_defect(make_inertia(*keys.load_inertia, keys.load_products));
      if (!defect.empty()) throw places.make_error_at("plant.load_inertia_kg_m2", defect);
      return;
    }
    for (std::size_t i = 0; i < keys.cables.size(); ++i)
      if (!keys.cables[i].attachment.isZero(0.0))
        throw places.make_error_at(
            "plant.cables[" + std::to_string(i) + "].attachment_m",
            "expected [0, 0, 0] of a load without load_inertia_kg_m2, which is a point, got " +
                show(keys.cables[i].attachment));
    for (const auto& [key, is_there] :
         {std::pair{"load_inertia_products_kg_m2", !keys.load_products.isZero(0.0)},
          std::pair{"load_attitude", keys.load_attitude.has_value()},
          std::pair{"load_rates_rad_s", !keys.load_rates.isZero(0.0)}})
      if (is_there)
        throw places.make_error_at(std::string("plant.") + key,
                                   "of a load with load_inertia_kg_m2, here it is a point");
  }

  /// Every vehicle places the load by its own cable: all at the same point.
  static void check_start(const CablesKeys& keys, const config::Scenario& scenario,
                          const config::Places& places) {
    Eigen::Vector3d of_first;
    for (std::uint32_t id = 0; id < scenario.vehicles.size(); ++id) {
      const config::Scenario alone = config::make_vehicle_scenario(scenario, id);
      const std::string cable = "plant.cables[" + std::to_string(id) + "]";
      const double length = alone.vehicle.rod_length;
      if (!keys.cables.empty() && keys.cables[id].distance.value_or(0.0) > length)
        throw places.make_error_at(cable + ".distance_m",
                                   "expected at most the cable's length (" +
                                       config::to_text(length) + "), got " +
                                       config::to_text(*keys.cables[id].distance));
      const Eigen::Vector3d centre =
          cables::calc_load_centre(keys, {id, alone.vehicle, alone.plant.initial}, id);
      if (id == 0) of_first = centre;
      constexpr double kRounding = 1e-9;  // m, of the sums in a file
      if ((centre - of_first).norm() > kRounding)
        throw places.make_error_at("vehicles[" + std::to_string(id) + "].offset_m",
                                   "expected an offset that places the load's centre at " +
                                       show(of_first) + " as vehicle 0 does, got " + show(centre));
    }
  }
};

}  // namespace

std::string find_count_defect(const CablesKeys& keys, std::size_t vehicles) {
  if (keys.cables.empty() || keys.cables.size() == vehicles) return "";
  return "expected one for each of " + std::to_string(vehicles) + " vehicles, got " +
         std::to_string(keys.cables.size());
}

const config::ModelKeys<config::Plant>& cables_keys() {
  static const CablesOwnKeys keys;
  return keys;
}

}  // namespace sls::sim
