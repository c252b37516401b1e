#include "sim_server/plants/multirotor/keys.hpp"

#include <algorithm>

#include "common/config/own_keys.hpp"
#include "sim_server/plants/inertia.hpp"
#include "sim_server/plants/multirotor/airframe.hpp"

namespace sls::sim {
namespace {

using config::to_text;

class MultirotorOwnKeys : public config::OwnKeys<config::Plant, MultirotorKeys> {
 public:
  bool has_attitude() const override { return true; }

  config::VehicleShape calc_shape(const config::Plant& plant) const override {
    const auto& keys = plant.own.get<MultirotorKeys>();
    config::VehicleShape shape{keys.attachment, {}};
    for (const RotorKeys& rotor : keys.rotors)
      shape.rotors.push_back({rotor.position, rotor.spin == Spin::kCounterClockwise ? 1 : -1});
    return shape;
  }

  void check(const config::Scenario& scenario, const config::Places& places) const override {
    const auto& keys = scenario.plant.own.get<MultirotorKeys>();
    check_inertia(keys, places);
    check_rotors(keys, places);
    check_pendulum(keys, places);
    for (std::uint32_t id = 0; id < scenario.vehicles.size(); ++id)
      check_vehicle(keys, config::make_vehicle_scenario(scenario, id).vehicle,
                    scenario.vehicles.size() > 1 ? "vehicles[" + std::to_string(id) + "]."
                                                 : std::string("vehicle."),
                    places);
  }

 private:
  static void check_inertia(const MultirotorKeys& keys, const config::Places& places) {
    const auto check = [&](const std::string& path, const Eigen::Vector3d& moments,
                           const Eigen::Vector3d& products) {
      const std::string defect = find_inertia_defect(make_inertia(moments, products));
      if (!defect.empty()) throw places.make_error_at(path, defect);
    };
    check("plant.inertia_kg_m2", keys.inertia, keys.products);
    for (std::size_t i = 0; i < keys.bodies.size(); ++i)
      check("plant.bodies[" + std::to_string(i) + "].inertia_kg_m2", keys.bodies[i].inertia,
            Eigen::Vector3d::Zero());
    if (keys.rod) check("plant.rod.inertia_kg_m2", keys.rod->inertia, Eigen::Vector3d::Zero());
    if (keys.load_inertia)
      check("plant.load_inertia_kg_m2", *keys.load_inertia, Eigen::Vector3d::Zero());
  }

  static void check_rotors(const MultirotorKeys& keys, const config::Places& places) {
    for (std::size_t i = 0; i < keys.rotors.size(); ++i)
      if (keys.rotors[i].axis.isZero(0.0))
        throw places.make_error_at("plant.rotors[" + std::to_string(i) + "].axis",
                                   "expected a vector other than 0, got [0, 0, 0]");
    const std::vector<FlyingRotor> rotors = make_rotors(keys);
    for (std::size_t i = 0; i < rotors.size(); ++i)
      if (rotors[i].min_speed > rotors[i].max_speed)
        throw places.make_error_at("plant.rotors[" + std::to_string(i) + "]",
                                   "expected min_speed_rad_s of at most max_speed_rad_s (" +
                                       to_text(rotors[i].max_speed) + "), got " +
                                       to_text(rotors[i].min_speed));
  }

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
  }

  /// The equations divide by the inertia of all bodies and of the pendulum; each part may have 0.
  static void check_sums(const MultirotorKeys& keys, const model::SlungLoadParameters& vehicle,
                         const config::Places& places) {
    const Eigen::Vector3d moments =
        calc_principal_moments(make_airframe(keys, vehicle.quad_mass).inertia_C_B);
    if (!(moments[0] > 1e-12 * moments[2]))  // smaller ones are rounding of 0
      throw places.make_error_at("plant.inertia_kg_m2",
                                 "expected an inertia > 0 about every axis, of airframe and bodies "
                                 "together, got 0");
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
    const double lift = calc_largest_lift(make_rotors(keys));
    if (lift < weight)
      throw places.make_error_at("plant.rotors", "expected to lift the vehicle (" +
                                                     to_text(weight) + " N), got " + to_text(lift) +
                                                     " N at the largest speeds");
  }
};

}  // namespace

const config::ModelKeys<config::Plant>& multirotor_keys() {
  static const MultirotorOwnKeys keys;
  return keys;
}

}  // namespace sls::sim
