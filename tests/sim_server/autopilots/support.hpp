/// The vehicle of the autopilot tests: a body with different rotors, and a set-point.
#pragma once

#include "sim_server/autopilots/autopilot.hpp"

namespace sls::sim {

/// Four different rotors on a body with the centre of mass away from its origin.
inline Airframe make_airframe() {
  Airframe airframe;
  airframe.mass = 1.55;
  airframe.p_BC = {0.01, -0.02, 0.03};
  airframe.inertia_C_B << 0.030, 0.001, 0.002, 0.001, 0.029, 0.003, 0.002, 0.003, 0.061;
  const Eigen::Vector2d places[] = {{0.13, 0.22}, {-0.13, -0.20}, {0.13, -0.22}, {-0.13, 0.20}};
  for (int i = 0; i < 4; ++i) {
    Rotor& rotor = airframe.rotors.emplace_back();
    rotor.p_BR << places[i], -0.02;
    if (i == 3) rotor.axis_B = {0.0, 0.6, -0.8};
    rotor.spin = i < 2 ? 1.0 : -1.0;
    rotor.thrust_constant = (5.0 + i) * 1e-6;
    rotor.torque_constant = 0.05 + 0.01 * i;
    rotor.min_speed = 10.0 * i;
    rotor.max_speed = 1100.0 + i;
  }
  return airframe;
}

inline AutopilotSetup make_setup(const std::string& model, config::OwnValues own = {}) {
  AutopilotSetup setup;
  setup.autopilot.model = {model, "flight.yaml:9"};
  setup.autopilot.own = std::move(own);
  setup.autopilot.period_ns = 4'000'000;
  setup.vehicle_id = 3;
  setup.vehicle.quad_mass = 1.5;
  setup.vehicle.load_mass = 0.2;
  setup.vehicle.rod_length = 1.1;
  setup.vehicle.gravity = 9.8;
  setup.airframe = make_airframe();
  return setup;
}

inline AutopilotInput make_input(const Eigen::Vector3d& f_Q_W) {
  AutopilotInput input{f_Q_W, {0.1, 0.2, 0.3}, {}};
  input.attitude.q_WB = Eigen::Quaterniond(0.5, -0.5, 0.5, 0.5);
  input.attitude.w_WB_B = {0.4, 0.5, 0.6};
  return input;
}

}  // namespace sls::sim
