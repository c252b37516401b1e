/// Airframes for the tests of autopilots, and a rigid body that turns under a held moment.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <cmath>
#include <random>
#include <vector>

#include "sim_server/autopilots/autopilot.hpp"

namespace sls::sim::test {

using Eigen::Matrix3d, Eigen::Quaterniond, Eigen::Vector3d, Eigen::VectorXd;

constexpr double kPi = 3.14159265358979323846;

inline Rotor make_rotor(double x, double y, double spin) {
  Rotor rotor;
  rotor.p_BR = {x, y, 0.0};
  rotor.spin = spin;
  rotor.thrust_constant = 5e-6;
  rotor.torque_constant = 0.05;
  rotor.max_speed = 1100.0;
  return rotor;
}

/// The vehicle of the published PX4 flight.
inline Airframe make_published_airframe() {
  Airframe airframe;
  airframe.mass = 1.55;
  airframe.inertia_C_B = Vector3d(0.0300, 0.0295, 0.0564).asDiagonal();
  airframe.rotors = {make_rotor(0.13, 0.22, 1), make_rotor(-0.13, -0.20, 1),
                     make_rotor(0.13, -0.22, -1), make_rotor(-0.13, 0.20, -1)};
  return airframe;
}

/// `count` rotors on a circle with alternating spins.
inline Airframe make_ring(int count) {
  Airframe airframe = make_published_airframe();
  airframe.rotors.clear();
  for (int i = 0; i < count; ++i) {
    const double angle = kPi * (2 * i + 1) / count;
    airframe.rotors.push_back(
        make_rotor(0.25 * std::cos(angle), 0.25 * std::sin(angle), i % 2 == 0 ? 1 : -1));
  }
  return airframe;
}

inline AutopilotSetup make_setup(const Airframe& airframe) {
  AutopilotSetup setup;
  setup.autopilot.period_ns = 4'000'000;
  setup.vehicle = {1.55, 0.15, 1.0, 9.8066};
  setup.airframe = airframe;
  return setup;
}

inline Vector3d make_random_vector(std::mt19937_64& random) {
  std::uniform_real_distribution<double> any(-1.0, 1.0);
  return {any(random), any(random), any(random)};
}

inline Quaterniond make_random_attitude(std::mt19937_64& random) {
  std::normal_distribution<double> any;
  return Quaterniond(any(random), any(random), any(random), any(random)).normalized();
}

/// Moment of all rotors at `speeds` about the centre of mass, in B.
inline Vector3d calc_torque(const Airframe& airframe, const VectorXd& speeds) {
  Vector3d torque = Vector3d::Zero();
  for (std::size_t i = 0; i < airframe.rotors.size(); ++i) {
    const Rotor& rotor = airframe.rotors[i];
    const double speed = speeds[static_cast<Eigen::Index>(i)];
    const Vector3d thrust_B = rotor.thrust_constant * speed * speed * rotor.axis_B;
    torque += (rotor.p_BR - airframe.p_BC).cross(thrust_B);
    torque -= rotor.spin * rotor.torque_constant * thrust_B;
  }
  return torque;
}

inline double calc_lift(const Airframe& airframe, const VectorXd& speeds) {
  double lift = 0.0;
  for (std::size_t i = 0; i < airframe.rotors.size(); ++i) {
    const double speed = speeds[static_cast<Eigen::Index>(i)];
    lift -= airframe.rotors[i].axis_B.z() * airframe.rotors[i].thrust_constant * speed * speed;
  }
  return lift;
}

/// A rotation matrix and its rate: Euler's equations, without quaternions.
struct Turning {
  Matrix3d R = Matrix3d::Identity();
  Vector3d w = Vector3d::Zero();

  model::Attitude attitude() const { return {Quaterniond(R).normalized(), w}; }
};

/// One step of the classical Runge–Kutta method; `calc_moment(turning)` is in the body's axes.
template <class CalcMoment>
Turning turn(const Turning& from, const Matrix3d& inertia, double h,
             const CalcMoment& calc_moment) {
  const auto rate = [&](const Turning& at) {
    Matrix3d hat;
    hat << 0, -at.w.z(), at.w.y(), at.w.z(), 0, -at.w.x(), -at.w.y(), at.w.x(), 0;
    const Vector3d moment = calc_moment(at);
    const Vector3d gyroscopic = at.w.cross(inertia * at.w);
    return Turning{at.R * hat, inertia.inverse() * (moment - gyroscopic)};
  };
  const auto add = [&](double step, const Turning& change) {
    return Turning{from.R + step * change.R, from.w + step * change.w};
  };
  const Turning k1 = rate(from), k2 = rate(add(h / 2, k1)), k3 = rate(add(h / 2, k2)),
                k4 = rate(add(h, k3));
  Turning to;
  to.R = from.R + h / 6 * (k1.R + 2 * k2.R + 2 * k3.R + k4.R);
  to.w = from.w + h / 6 * (k1.w + 2 * k2.w + 2 * k3.w + k4.w);
  to.R = Quaterniond(to.R).normalized().toRotationMatrix();
  return to;
}

/// True if all bits are equal.
inline bool is_same(const AutopilotOutput& a, const AutopilotOutput& b) {
  return a.rotor_speeds == b.rotor_speeds && a.q_WB.coeffs() == b.q_WB.coeffs() &&
         a.thrust == b.thrust && a.direction_W == b.direction_W;
}

}  // namespace sls::sim::test
