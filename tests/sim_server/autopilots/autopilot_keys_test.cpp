// Scenario keys of `px4` and `geometric`: defaults, every key read, written and read again.
#include <gtest/gtest.h>

#include "common/config/scenario.hpp"
#include "sim_server/autopilots/geometric/keys.hpp"
#include "sim_server/autopilots/px4/keys.hpp"

namespace sls::sim {
namespace {

std::string make_text(const std::string& autopilot) {
  return R"(name: keys
vehicle: { quad_mass_kg: 1.55, load_mass_kg: 0.15, rod_length_m: 1, gravity_m_s2: 9.8066 }
plant:
  model: multirotor
  inertia_kg_m2: [0.03, 0.03, 0.06]
  rotor: { thrust_constant_n_s2: 5e-6, torque_constant_m: 0.05, max_speed_rad_s: 1100 }
  rotors:
    - { position_m: [0.13, 0.22, 0], spin: ccw }
    - { position_m: [-0.13, -0.2, 0], spin: ccw }
    - { position_m: [0.13, -0.22, 0], spin: cw }
    - { position_m: [-0.13, 0.2, 0], spin: cw }
  initial: { load_position_m: [0, 0, -0.5] }
mission:
  - hold: { position_m: [0, 0, -0.5] }
    for_s: 2
autopilot:
)" + autopilot;
}

config::Autopilot read(const std::string& autopilot) {
  return *config::parse_scenario(make_text(autopilot), "file").autopilot;
}

/// Reads the keys, writes them and reads them again.
config::Autopilot read_twice(const std::string& autopilot) {
  const config::Scenario scenario = config::parse_scenario(make_text(autopilot), "file");
  return *config::parse_scenario(config::to_yaml(scenario), "written").autopilot;
}

TEST(Px4KeysTest, DefaultsAreThePublishedFlights) {
  const config::Autopilot autopilot = read("  model: px4\n");
  EXPECT_EQ(autopilot.period_ns, 4'000'000);
  const auto& keys = autopilot.own.get<px4::Keys>();
  const double degree = std::acos(-1.0) / 180;
  EXPECT_EQ(keys.thrust_map, px4::ThrustMap::kAffine);
  EXPECT_FALSE(keys.affine_thrust);
  EXPECT_FALSE(keys.mixer);
  EXPECT_EQ(px4::AffineThrust().force, 16.67122);
  EXPECT_EQ(px4::AffineThrust().thrust, 0.8168);
  EXPECT_EQ(px4::AffineThrust().force_per_thrust, 20.0);
  EXPECT_EQ(keys.attitude.per_rad, Eigen::Vector3d(6.5, 6.5, 2.8));
  EXPECT_EQ(keys.attitude.yaw_weight, 0.4);
  EXPECT_NEAR((keys.attitude.rate_limits - degree * Eigen::Vector3d(220, 220, 200)).norm(), 0.0,
              1e-14);
  EXPECT_EQ(keys.rates.proportional, Eigen::Vector3d(0.15, 0.15, 0.2));
  EXPECT_EQ(keys.rates.integral, Eigen::Vector3d(0.2, 0.2, 0.1));
  EXPECT_EQ(keys.rates.derivative, Eigen::Vector3d(0.003, 0.003, 0));
  EXPECT_EQ(keys.rates.integral_limits, Eigen::Vector3d(0.3, 0.3, 0.3));
  EXPECT_NEAR(keys.rates.integral_off_error, 400 * degree, 1e-14);
  EXPECT_EQ(keys.rates.rate_cut_off, 40.0);
  EXPECT_EQ(keys.rates.derivative_cut_off, 30.0);
  EXPECT_EQ(keys.speeds.speed_at_zero, 100.0);
  EXPECT_EQ(keys.speeds.speed_per_output, 1000.0);
}

TEST(Px4KeysTest, EveryKeyIsReadAndSurvivesBeingWritten) {
  const config::Autopilot autopilot = read_twice(R"(  model: px4
  period_s: 0.002
  thrust_map: affine
  affine_thrust: { force_n: 10, thrust: 0.5, force_per_thrust_n: 30 }
  attitude: { gains_per_s: [1, 2, 3], yaw_weight: 0.5, rate_limits_rad_s: [4, 5, 6] }
  rates:
    proportional_per_rad_s: [0.1, 0.2, 0.3]
    integral_per_rad: [0.4, 0.5, 0.6]
    derivative_per_rad_s2: [0.01, 0.02, 0.03]
    integral_limits: [0.7, 0.8, 0.9]
    integral_off_error_rad_s: 5
    rate_cut_off_hz: 60
    derivative_cut_off_hz: 0
  mixer:
    - { roll: -0.438, pitch: 0.707, yaw: 0.909 }
    - { roll: 0.438, pitch: -0.707, yaw: 1 }
    - { roll: 0.438, pitch: 0.707, yaw: -0.909 }
    - { roll: -0.438, pitch: -0.707, yaw: -1, thrust: 0.9 }
  rotor_speeds: { at_zero_rad_s: 50, per_output_rad_s: 900 }
)");
  EXPECT_EQ(autopilot.period_ns, 2'000'000);
  const auto& keys = autopilot.own.get<px4::Keys>();
  EXPECT_EQ(keys.thrust_map, px4::ThrustMap::kAffine);
  EXPECT_EQ(keys.affine_thrust->force, 10.0);
  EXPECT_EQ(keys.affine_thrust->thrust, 0.5);
  EXPECT_EQ(keys.affine_thrust->force_per_thrust, 30.0);
  EXPECT_EQ(keys.attitude.per_rad, Eigen::Vector3d(1, 2, 3));
  EXPECT_EQ(keys.attitude.yaw_weight, 0.5);
  EXPECT_EQ(keys.attitude.rate_limits, Eigen::Vector3d(4, 5, 6));
  EXPECT_EQ(keys.rates.proportional, Eigen::Vector3d(0.1, 0.2, 0.3));
  EXPECT_EQ(keys.rates.integral, Eigen::Vector3d(0.4, 0.5, 0.6));
  EXPECT_EQ(keys.rates.derivative, Eigen::Vector3d(0.01, 0.02, 0.03));
  EXPECT_EQ(keys.rates.integral_limits, Eigen::Vector3d(0.7, 0.8, 0.9));
  EXPECT_EQ(keys.rates.integral_off_error, 5.0);
  EXPECT_EQ(keys.rates.rate_cut_off, 60.0);
  EXPECT_EQ(keys.rates.derivative_cut_off, 0.0);
  ASSERT_EQ(keys.mixer->size(), 4u);
  EXPECT_EQ(keys.mixer->at(0).roll, -0.438);
  EXPECT_EQ(keys.mixer->at(0).pitch, 0.707);
  EXPECT_EQ(keys.mixer->at(0).yaw, 0.909);
  EXPECT_EQ(keys.mixer->at(0).thrust, 1.0);
  EXPECT_EQ(keys.mixer->at(3).thrust, 0.9);
  EXPECT_EQ(keys.speeds.speed_at_zero, 50.0);
  EXPECT_EQ(keys.speeds.speed_per_output, 900.0);
}

TEST(GeometricKeysTest, GainsFollowFromTheInertiaUnlessTheFileSetsThem) {
  const config::Autopilot usual = read_twice("  model: geometric\n");
  EXPECT_EQ(usual.period_ns, 4'000'000);
  EXPECT_FALSE(usual.own.get<geometric::Keys>().attitude);
  EXPECT_FALSE(usual.own.get<geometric::Keys>().rate);
  const config::Autopilot own =
      read_twice("  model: geometric\n  attitude_n_m: 4\n  rate_n_m_s: 0.7\n");
  EXPECT_EQ(own.own.get<geometric::Keys>().attitude, 4.0);
  EXPECT_EQ(own.own.get<geometric::Keys>().rate, 0.7);
}

}  // namespace
}  // namespace sls::sim
