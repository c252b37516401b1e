#include "sim_server/plants/multirotor/keys.hpp"

#include <algorithm>

#include "common/config/own_keys.hpp"
#include "sim_server/plants/inertia.hpp"

namespace sls::sim {
namespace {

using config::to_text;

class MultirotorOwnKeys : public config::OwnKeys<config::Plant, MultirotorKeys> {
 public:
  bool has_attitude(const config::Plant&) const override { return true; }

  config::VehicleShape calc_shape(const config::Plant& plant) const override {
    const auto& keys = plant.own.get<MultirotorKeys>();
    return make_shape(keys.rotors, keys.attachment);
  }

  double calc_swing_rate(const config::Scenario& scenario, std::uint32_t id) const override {
    const auto& keys = scenario.plant.own.get<MultirotorKeys>();
    const model::SlungLoadParameters vehicle = make_vehicle_scenario(scenario, id).vehicle;
    const double rod = keys.rod ? keys.rod->mass : 0.0, mass = vehicle.load_mass + rod;
    const double moment =
        vehicle.load_mass * vehicle.rod_length + (keys.rod ? rod * keys.rod->centre : 0.0);
    const double arm = keys.attachment.norm(), inertia = keys.inertia.minCoeff();
    const double mobility = 1.0 / vehicle.quad_mass + arm * arm / inertia;
    return std::sqrt(mass * vehicle.gravity *
                     ((1.0 / mass + mobility) * mass / moment + arm / inertia));
  }

  void check(const config::Scenario& scenario, const config::Places& places) const override {
    const auto& keys = scenario.plant.own.get<MultirotorKeys>();
    check_rotor_signals(scenario, keys.rotors.size(), 1, "air and thrust", places);
    check_airframe(keys, places);
    check_rod_angles(scenario.plant, places);
    check_pendulum(keys, places);
    for (std::uint32_t id = 0; id < scenario.vehicles.size(); ++id)
      check_vehicle(keys, config::make_vehicle_scenario(scenario, id).vehicle,
                    scenario.vehicles.size() > 1 ? "vehicles[" + std::to_string(id) + "]."
                                                 : std::string("vehicle."),
                    places);
  }

 private:
  static void check_pendulum(const MultirotorKeys& keys, const config::Places& places) {
    const bool is_rigid = keys.pendulum == Pendulum::kRigid;
    for (const auto& [path, is_there] :
         {std::pair{"plant.rod", keys.rod.has_value()},
          std::pair{"plant.load_inertia_kg_m2", keys.load_inertia.has_value()}}) {
      if (is_there && !is_rigid)
        throw places.make_error_at(path, "of pendulum 'rigid', here it is 'ideal'");
      if (!is_there && is_rigid)
        throw places.make_error_at(path, "missing key; expected with pendulum 'rigid'");
    }
    // With 0 nothing resists a spin about the rod, and the equations have no solution.
    if (is_rigid && !(keys.rod->inertia.z() + keys.load_inertia->z() > 0.0))
      throw places.make_error_at("plant.load_inertia_kg_m2",
                                 "expected an inertia > 0 about the rod, of rod or load, got 0");
    const auto check_links = [&](const std::string& path, const Eigen::Vector3d& moments) {
      const std::string defect = find_inertia_defect(moments.asDiagonal());
      if (!defect.empty()) throw places.make_error_at(path, defect);
    };
    if (keys.rod) check_links("plant.rod.inertia_kg_m2", keys.rod->inertia);
    if (keys.load_inertia) check_links("plant.load_inertia_kg_m2", *keys.load_inertia);
  }

  /// The equations divide by the inertia of all bodies and of the pendulum; each part may have 0.
  static void check_sums(const MultirotorKeys& keys, const model::SlungLoadParameters& vehicle,
                         const config::Places& places) {
    check_inertia(keys, vehicle.quad_mass, places);
    if (!keys.rod) return;
    const double distance = vehicle.rod_length - keys.rod->centre;
    const double of_masses = vehicle.load_mass * keys.rod->mass /
                             (vehicle.load_mass + keys.rod->mass) * distance * distance;
    const Eigen::Vector3d across = keys.rod->inertia + *keys.load_inertia;
    if (!(std::min(across.x(), across.y()) + of_masses > 0.0))
      throw places.make_error_at("plant.load_inertia_kg_m2",
                                 "expected an inertia > 0 across the rod, of rod and load "
                                 "together, got 0");
  }

  static void check_vehicle(const MultirotorKeys& keys, const model::SlungLoadParameters& vehicle,
                            const std::string& place, const config::Places& places) {
    double fixed = 0.0;
    for (const FixedBodyKeys& body : keys.bodies) fixed += body.mass;
    if (!(vehicle.quad_mass > fixed))
      throw places.make_error_at(place + "quad_mass_kg",
                                 "expected more than the bodies fixed to it (" + to_text(fixed) +
                                     "), got " + to_text(vehicle.quad_mass));
    if (keys.attachment.norm() > vehicle.rod_length)
      throw places.make_error_at("plant.attachment_m",
                                 "expected at most a rod's length (" + to_text(vehicle.rod_length) +
                                     ") from the origin, got " + to_text(keys.attachment.norm()));
    check_sums(keys, vehicle, places);
    if (keys.rod && keys.rod->centre > vehicle.rod_length)
      throw places.make_error_at("plant.rod.centre_m", "expected at most the rod's length (" +
                                                           to_text(vehicle.rod_length) + "), got " +
                                                           to_text(keys.rod->centre));
    const double weight =
        (vehicle.total_mass() + (keys.rod ? keys.rod->mass : 0.0)) * vehicle.gravity;
    check_lift(keys, weight, "the vehicle", places);
  }
};

}  // namespace

const config::ModelKeys<config::Plant>& multirotor_keys() {
  static const MultirotorOwnKeys keys;
  return keys;
}

}  // namespace sls::sim
