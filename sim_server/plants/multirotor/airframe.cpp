#include "sim_server/plants/multirotor/airframe.hpp"

#include <Eigen/LU>

#include "sim_server/plants/inertia.hpp"

namespace sls::sim {
namespace {

using Eigen::Matrix3d, Eigen::Vector3d;

/// Inertia of a point mass at `p` about the origin.
Matrix3d calc_point_inertia(double mass, const Vector3d& p) {
  return mass * (p.squaredNorm() * Matrix3d::Identity() - p * p.transpose());
}

}  // namespace

std::vector<FlyingRotor> make_rotors(const AirframeKeys& keys) {
  std::vector<FlyingRotor> rotors;
  for (const RotorKeys& described : keys.rotors) {
    const RotorNumbers<double>& all = keys.rotor;
    const RotorNumbers<std::optional<double>>& own = described.own;
    FlyingRotor rotor;
    rotor.p_BR = described.position;
    rotor.axis_B = described.axis.normalized();
    rotor.spin = described.spin == Spin::kCounterClockwise ? 1.0 : -1.0;
    rotor.thrust_constant = own.thrust_constant.value_or(all.thrust_constant);
    rotor.torque_constant = own.torque_constant.value_or(all.torque_constant);
    rotor.drag_constant = own.drag_constant.value_or(all.drag_constant);
    rotor.rolling_constant = own.rolling_constant.value_or(all.rolling_constant);
    rotor.min_speed = own.min_speed.value_or(all.min_speed);
    rotor.max_speed = own.max_speed.value_or(all.max_speed);
    rotor.lag_up = own.lag_up.value_or(all.lag_up);
    rotor.lag_down = own.lag_down.value_or(all.lag_down);
    rotor.thrust_loss_speed = own.thrust_loss_speed.value_or(all.thrust_loss_speed);
    rotor.thrust_scale = described.thrust_scale;
    rotors.push_back(rotor);
  }
  return rotors;
}

Airframe make_airframe(const AirframeKeys& keys, double quad_mass) {
  Airframe airframe;
  airframe.mass = quad_mass;
  double bare_mass = quad_mass;
  for (const FixedBodyKeys& body : keys.bodies) {
    bare_mass -= body.mass;
    airframe.p_BC += body.mass / quad_mass * body.position;
  }
  // Inertia about the centre of mass: of each part about its own centre, plus that of its mass at
  // its position.
  airframe.inertia_C_B =
      make_inertia(keys.inertia, keys.products) + calc_point_inertia(bare_mass, -airframe.p_BC);
  for (const FixedBodyKeys& body : keys.bodies)
    airframe.inertia_C_B += Matrix3d(body.inertia.asDiagonal()) +
                            calc_point_inertia(body.mass, body.position - airframe.p_BC);
  for (const FlyingRotor& rotor : make_rotors(keys)) airframe.rotors.push_back(rotor);
  return airframe;
}

double calc_largest_lift(const std::vector<FlyingRotor>& rotors) {
  double lift = 0.0;
  for (const FlyingRotor& rotor : rotors)
    lift -= rotor.axis_B.z() * rotor.thrust_constant * rotor.max_speed * rotor.max_speed;
  return lift;
}

}  // namespace sls::sim
