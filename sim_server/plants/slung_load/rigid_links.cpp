#include "sim_server/plants/slung_load/rigid_links.hpp"

#include "common/config/numbers.hpp"
#include "common/config/scenario.hpp"

namespace sls::sim {

std::optional<RigidContradiction> find_rigid_contradiction(
    const model::SlungLoadParameters& vehicle) {
  const auto contradiction = [](const char* key, const std::string& expected, double value) {
    return RigidContradiction{key, "expected " + expected +
                                       " (the rigid pendulum's links bring it), got " +
                                       config::to_text(value)};
  };
  const double load_and_rod = kRigidLoad.mass + kRigidRod.mass;
  if (vehicle.quad_mass != kRigidBaseMass)
    return contradiction("quad_mass_kg", config::to_text(kRigidBaseMass), vehicle.quad_mass);
  if (vehicle.load_mass != kRigidLoad.mass && vehicle.load_mass != load_and_rod)
    return contradiction("load_mass_kg",
                         config::to_text(kRigidLoad.mass) + " or " + config::to_text(load_and_rod),
                         vehicle.load_mass);
  if (vehicle.rod_length != kRigidLoad.distance)
    return contradiction("rod_length_m", config::to_text(kRigidLoad.distance), vehicle.rod_length);
  return std::nullopt;
}

void check_rigid_vehicle(const model::SlungLoadParameters& vehicle, const std::string& place) {
  const auto contradiction = find_rigid_contradiction(vehicle);
  if (!contradiction) return;
  const std::string prefix = place.empty() ? "" : place + ": ";
  throw config::ConfigError(prefix + "vehicle." + contradiction->key + ": " +
                            contradiction->message);
}

}  // namespace sls::sim
