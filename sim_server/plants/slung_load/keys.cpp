#include "sim_server/plants/slung_load/keys.hpp"

#include "common/config/own_keys.hpp"
#include "sim_server/plants/slung_load/rigid_links.hpp"

namespace sls::sim {
namespace {

class SlungLoadOwnKeys : public config::OwnKeys<config::Plant, SlungLoadKeys> {
  /// With `rigid` a vehicle must have the masses and length of the published links.
  void check(const config::Scenario& scenario, const config::Places& places) const override {
    check_rod_angles(scenario.plant, places);
    if (scenario.plant.own.get<SlungLoadKeys>().pendulum != Pendulum::kRigid) return;
    const auto check_one = [&](const std::string& place, const model::SlungLoadParameters& flown) {
      if (const auto contradiction = find_rigid_contradiction(flown))
        throw places.make_error_at(place + "." + contradiction->key, contradiction->message);
    };
    check_one("vehicle", scenario.vehicle);
    for (std::uint32_t id = 0; id < scenario.vehicles.size(); ++id)
      check_one("vehicles[" + std::to_string(id) + "]",
                config::make_vehicle_scenario(scenario, id).vehicle);
  }
};

}  // namespace

const config::ModelKeys<config::Plant>& slung_load_keys() {
  static const SlungLoadOwnKeys keys;
  return keys;
}

}  // namespace sls::sim
