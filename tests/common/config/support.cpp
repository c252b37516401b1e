#include "tests/common/config/support.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <regex>

#include "tests/support/errors.hpp"

namespace sls::config::test {
const char* const kMinimalScenario =
    "name: minimal\n"
    "vehicle:\n"
    "  quad_mass_kg: 1.5\n"
    "  load_mass_kg: 0.2\n"
    "  rod_length_m: 1.0\n"
    "  gravity_m_s2: 9.8\n"
    "plant:\n"
    "  initial: { load_position_m: [0, 0, -0.5] }\n"
    "mission:\n"
    "  - hold: { position_m: [0, 0, -0.5] }\n"
    "    for_s: 2\n";

const char* const kEveryKey = R"(
name: every_key
vehicle: { quad_mass_kg: 1.6, load_mass_kg: 0.16, rod_length_m: 0.7, gravity_m_s2: 10 }
vehicles:
  - { offset_m: [1, 2, 3], quad_mass_kg: 1.8, load_mass_kg: 0.18, rod_length_m: 0.9, thrust_scale: 0.95,
      quad_velocity_m_s: [0.3, 0.2, 0.1] }
  - {}
plant:
  pendulum: ideal
  step_s: 0.0005
  initial:
    quad_position_m: [1, 2, -4]
    quad_velocity_m_s: [0.1, 0.2, 0.3]
    alpha_rad: 0.4
    beta_rad: -0.5
    alpha_dot_rad_s: 0.6
    beta_dot_rad_s: -0.7
  rotor_drag_n_s_m: 0.3
  wind_m_s: [2, -1, 0.5]
  wind:
    gusts: [{ at_s: 3, rise_s: 0.5, for_s: 2, wind_m_s: [1, 0, -1] }, { at_s: 4, wind_m_s: [0, 1, 0] }]
    turbulence: { altitude_m: 20, w20_m_s: 7.7, seed: 5 }
  thrust:
    scale: 0.925
    drift_per_s: -0.001
    battery: { full_v: 16.8, empty_v: 14, resistance_ohm: 0.02, capacity_ah: 5, hover_power_w: 250 }
    failures: [{ at_s: 2, vehicle: 1, thrust_scale: 0.5 }, { at_s: 3 }]
  load_drag: { linear_n_s_m: 0.1, area_m2: 0.02, air_density_kg_m3: 1.1 }
  disturbance_n: [0.1, 0, -0.1]
sync:
  mode: realtime
  period_s: 0.002
  real_time_factor: 2.5
  take_over_s: 0.25
  max_hold_s: 0.75
  wait_for: { controllers: 2, recorders: 0, timeout_s: 7.5 }
  wait:
    controller: { policy: hold, deadline_s: 0.5 }
    recorder: { policy: go_on, deadline_s: 0.6 }
    server: { deadline_s: 12 }
controller:
  law: qsf
  gains:
    horizontal: { position: 1, velocity: 2, acceleration: 3, jerk: 4, integral: 5 }
    vertical: { position: 6, velocity: 7, integral: 8 }
  force_limit_n: 50
  saturate: true
  drag_feed_forward: true
  state_wiring: gazebo_plugin
  model:
    { quad_mass_kg: 1.7, load_mass_kg: 0.17, rod_length_m: 0.8, gravity_m_s2: 9.9,
      rotor_drag_n_s_m: 0.4, wind_m_s: [3, -2, 1] }
mission:
  - hold: { position_m: [0, 0, -1] }
    for_s: 1
    name: first
  - set_point: { position_m: [1, 0, -1] }
    until: { within_m: 0.3, after_s: 4, of: quadrotor, offset_m: [0, 0, -0.95], timeout_s: 9 }
  - figure_eight: { amplitude_m: [1, 2, 3], offset_m: [4, 5, 6], period_s: 12 }
    until: { within_m: 0.4, after_s: 5 }
  - rest_to_rest: { from_m: [1, 1, 1], to_m: [2, 2, 2], duration_s: 3 }
    for_s: 4
faults:
  - delay: { on: command, vehicle: 1, from_s: 1, to_s: 2, by_s: 0.02 }
  - drop: { on: state, probability: 0.2, seed: 7, from_s: 4, to_s: 8 }
  - freeze: { on: state, from_s: 5, to_s: 5.2 }
  - reorder: { on: command, probability: 0.1, seed: 9223372036854775807 }
  - bias:
      { on: state, position_m: [0.1, 0.2, 0.3], velocity_m_s: [0.4, 0.5, 0.6], alpha_rad: 0.02,
        beta_rad: -0.03, alpha_dot_rad_s: 0.04, beta_dot_rad_s: -0.05 }
  - bias: { on: command, force_n: [0, 0, 1] }
  - noise:
      { on: state, seed: 3, position_m: [0.01, 0.02, 0.03], velocity_m_s: [0.04, 0.05, 0.06],
        alpha_rad: 0.07, beta_rad: 0.08, alpha_dot_rad_s: 0.09, beta_dot_rad_s: 0.1 }
  - noise: { force_n: [0.1, 0, 0], on: command }
sensing: { period_s: 0.033333333, age_s: 0.02, rod: { period_s: 0.02, age_s: 0.011 }, node_delay_s: 0.0105 }
estimator: { position_m: [0.1, 0.2, 0.3], velocity_m_s: [0.4, 0.5, 0.6] }
record: { flush_s: 0.05, format: [csv, mcap] }
)";

const char* const kEveryMultirotorKey = R"(name: everything
vehicle: { quad_mass_kg: 1.55, load_mass_kg: 0.15, rod_length_m: 0.9, gravity_m_s2: 9.8066 }
plant:
  model: multirotor
  inertia_kg_m2: [0.029125, 0.0292, 0.055225]
  inertia_products_kg_m2: [0.0001, -0.0002, 0.0003]
  rotor:
    thrust_constant_n_s2: 5.1e-6
    torque_constant_m: 0.05
    drag_constant_n_s2_m: 8.0e-5
    rolling_constant_n_s2: 1.0e-6
    min_speed_rad_s: 100
    max_speed_rad_s: 1500
    lag_up_s: 0.0125
    lag_down_s: 0.025
    thrust_loss_speed_m_s: 25
  rotors:
    - { position_m: [0.13, 0.22, -0.01], spin: ccw, axis: [0.1, 0, -2] }
    - position_m: [-0.13, -0.2, 0]
      spin: cw
      thrust_scale: 0.9
      thrust_constant_n_s2: 5.2e-6
      torque_constant_m: 0.06
      drag_constant_n_s2_m: 9.0e-5
      rolling_constant_n_s2: 2.0e-6
      min_speed_rad_s: 110
      max_speed_rad_s: 1600
      lag_up_s: 0.013
      lag_down_s: 0.026
      thrust_loss_speed_m_s: 26
  bodies:
    - { mass_kg: 0.03, position_m: [0.01, 0.02, 0.03], inertia_kg_m2: [1.0e-4, 2.0e-4, 2.5e-4] }
    - { mass_kg: 0.005 }
  pendulum: rigid
  attachment_m: [0.01, -0.02, 0.05]
  rod: { mass_kg: 0.01, centre_m: 0.45, inertia_kg_m2: [8.333e-4, 8.334e-4, 5.0e-5] }
  load_inertia_kg_m2: [1.0e-9, 2.0e-9, 3.0e-9]
  wind_m_s: [1, -2, 0.5]
  disturbance_n: [0.1, 0.2, -0.3]
  disturbance_torque_n_m: [0.001, -0.002, 0.003]
  step_s: 0.0005
  initial:
    quad_position_m: [1, 2, -3]
    attitude: [0.8, 0.36, -0.48, 0]
    body_rates_rad_s: [0.4, -0.5, 0.6]
autopilot:
  model: px4
  period_s: 0.002
  thrust_map: affine
  affine_thrust: { force_n: 16, thrust: 0.8, force_per_thrust_n: 21 }
  attitude: { gains_per_s: [6, 6.1, 2.9], yaw_weight: 0.3, rate_limits_rad_s: [3, 3.1, 3.2] }
  rates:
    proportional_per_rad_s: [0.15, 0.16, 0.21]
    integral_per_rad: [0.2, 0.21, 0.11]
    derivative_per_rad_s2: [0.003, 0.004, 0.001]
    integral_limits: [0.3, 0.31, 0.32]
    integral_off_error_rad_s: 6
    rate_cut_off_hz: 41
    derivative_cut_off_hz: 31
  mixer:
    - { roll: -0.4, pitch: 0.7, yaw: 0.9, thrust: 0.95 }
    - { roll: 0.4, pitch: -0.7, yaw: -1 }
  rotor_speeds: { at_zero_rad_s: 90, per_output_rad_s: 1010 }
estimator: { tilt_rad: [-0.0118, -0.0046], yaw_rad: 0.055 }
mission:
  - hold: { position_m: [1, 2, -3] }
    for_s: 1
)";

std::string make_autopilot_text(const std::string& autopilot) {
  return replace_once(kMinimalScenario, "plant:\n",
                      "autopilot: " + autopilot +
                          "\n"
                          "plant:\n"
                          "  model: multirotor\n"
                          "  inertia_kg_m2: [0.03, 0.03, 0.06]\n"
                          "  rotor: { thrust_constant_n_s2: 5.0e-6, max_speed_rad_s: 2000 }\n"
                          "  rotors: [{ position_m: [0, 0, 0], spin: ccw }]\n");
}

std::string find_error(const std::string& text) {
  return sls::test::find_error<ConfigError>([&] { parse_scenario(text, "file"); });
}

void expect_every_key(const std::string& text, const Scenario& expected) {
  const std::string written = to_yaml(parse_scenario(text, "file"));
  EXPECT_EQ(to_yaml(parse_scenario(written, "written")), to_yaml(expected));
  const std::regex key(
      "\"?[a-z_0-9]+\"?:");  // the writer quotes what YAML 1.1 reads as a truth value
  const auto name = [](std::string word) {
    word.erase(std::remove(word.begin(), word.end(), '"'), word.end());
    return word;
  };
  const auto count = [&](const std::string& in, const std::string& wanted) {
    return std::count_if(std::sregex_iterator(in.begin(), in.end(), key), {},
                         [&](const std::smatch& found) { return name(found.str()) == wanted; });
  };
  for (std::sregex_iterator at(text.begin(), text.end(), key), end; at != end; ++at)
    EXPECT_GE(count(written, name(at->str())), count(text, name(at->str()))) << at->str() << '\n'
                                                                             << written;
}

std::vector<std::filesystem::path> list_yaml_files(const std::string& folder) {
  std::vector<std::filesystem::path> files;
  const std::filesystem::path root = SLS_SOURCE_DIR;
  for (const auto& entry : std::filesystem::directory_iterator(root / folder))
    if (entry.path().extension() == ".yaml") files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  return files;
}

}  // namespace sls::config::test
