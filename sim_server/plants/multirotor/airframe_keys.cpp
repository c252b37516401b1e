#include "sim_server/plants/multirotor/airframe_keys.hpp"

#include "common/config/model_keys.hpp"
#include "common/config/scenario_reader.hpp"
#include "sim_server/plants/air/air.hpp"
#include "sim_server/plants/inertia.hpp"
#include "sim_server/plants/multirotor/airframe.hpp"
#include "sim_server/plants/thrust/thrust_source.hpp"

namespace sls::sim {

using config::to_text;

config::VehicleShape make_shape(const std::vector<RotorKeys>& rotors,
                                const Eigen::Vector3d& attachment) {
  config::VehicleShape shape{attachment, {}};
  for (const RotorKeys& rotor : rotors)
    shape.rotors.push_back({rotor.position, rotor.spin == Spin::kCounterClockwise ? 1 : -1});
  return shape;
}

void check_airframe(const AirframeKeys& keys, const config::Places& places) {
  const auto check = [&](const std::string& path, const Eigen::Vector3d& moments,
                         const Eigen::Vector3d& products) {
    const std::string defect = find_inertia_defect(make_inertia(moments, products));
    if (!defect.empty()) throw places.make_error_at(path, defect);
  };
  check("plant.inertia_kg_m2", keys.inertia, keys.products);
  for (std::size_t i = 0; i < keys.bodies.size(); ++i)
    check("plant.bodies[" + std::to_string(i) + "].inertia_kg_m2", keys.bodies[i].inertia,
          Eigen::Vector3d::Zero());
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

void check_inertia(const AirframeKeys& keys, double quad_mass, const config::Places& places) {
  const Eigen::Vector3d moments =
      calc_principal_moments(make_airframe(keys, quad_mass).inertia_C_B);
  if (!(moments[0] > 1e-12 * moments[2]))  // smaller ones are rounding of 0
    throw places.make_error_at("plant.inertia_kg_m2",
                               "expected an inertia > 0 about every axis, of airframe and bodies "
                               "together, got 0");
}

void check_rotor_signals(const config::Scenario& scenario, std::size_t rotors, std::size_t others,
                         const std::string& beside, const config::Places& places) {
  constexpr std::size_t kOfAll = 6;  // attitude set-point, and both thrusts
  const std::size_t taken =
      others + kOfAll + Air::count_signals(scenario.plant) + count_thrust_signals(scenario);
  const std::size_t most = (model::kMaxNumbers - taken) / 2;  // speed and set-point
  if (rotors > most)
    throw places.make_error_at("plant.rotors", "expected at most " + std::to_string(most) +
                                                   ", whose signals fit beside those of " + beside +
                                                   ", got " + std::to_string(rotors));
}

void check_lift(const AirframeKeys& keys, double weight, const std::string& lifted,
                const config::Places& places) {
  const double lift = calc_largest_lift(make_rotors(keys));
  if (lift < weight)
    throw places.make_error_at("plant.rotors", "expected to lift " + lifted + " (" +
                                                   to_text(weight) + " N), got " + to_text(lift) +
                                                   " N at the largest speeds");
}

}  // namespace sls::sim
