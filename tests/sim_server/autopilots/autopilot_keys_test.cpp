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
