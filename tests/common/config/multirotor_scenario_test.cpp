// Valid scenarios of the plant `multirotor`: their values, and a round trip through a written file.
#include <gtest/gtest.h>

#include <cmath>

#include "sim_server/autopilots/px4/keys.hpp"
#include "sim_server/plants/multirotor/keys.hpp"
#include "tests/common/config/support.hpp"

namespace sls::config::test {
namespace {

using Eigen::Vector3d;
using sim::MultirotorKeys;

void expect_rotors(const MultirotorKeys& keys) {
  const sim::RotorNumbers<double>& all = keys.rotor;
  EXPECT_EQ(all.thrust_constant, 5.1e-6);
  EXPECT_EQ(all.torque_constant, 0.05);
  EXPECT_EQ(all.drag_constant, 8e-5);
  EXPECT_EQ(all.rolling_constant, 1e-6);
  EXPECT_EQ(all.min_speed, 100.0);
  EXPECT_EQ(all.max_speed, 1500.0);
  EXPECT_EQ(all.lag_up, 0.0125);
  EXPECT_EQ(all.lag_down, 0.025);
  EXPECT_EQ(all.thrust_loss_speed, 25.0);
  ASSERT_EQ(keys.rotors.size(), 2u);
  const sim::RotorKeys &first = keys.rotors[0], &second = keys.rotors[1];
  EXPECT_EQ(first.position, Vector3d(0.13, 0.22, -0.01));
  EXPECT_EQ(first.axis, Vector3d(0.1, 0, -2));
  EXPECT_EQ(first.spin, sim::Spin::kCounterClockwise);
  EXPECT_FALSE(first.own.thrust_constant || first.own.min_speed || first.own.lag_up);
  EXPECT_EQ(second.position, Vector3d(-0.13, -0.2, 0));
  EXPECT_EQ(second.axis, Vector3d(0, 0, -1));
  EXPECT_EQ(second.spin, sim::Spin::kClockwise);
  EXPECT_EQ(second.own.thrust_constant, 5.2e-6);
  EXPECT_EQ(second.own.torque_constant, 0.06);
  EXPECT_EQ(second.own.drag_constant, 9e-5);
  EXPECT_EQ(second.own.rolling_constant, 2e-6);
  EXPECT_EQ(second.own.min_speed, 110.0);
  EXPECT_EQ(second.own.max_speed, 1600.0);
  EXPECT_EQ(second.own.lag_up, 0.013);
  EXPECT_EQ(second.own.lag_down, 0.026);
  EXPECT_EQ(second.own.thrust_loss_speed, 26.0);
}

void expect_bodies(const MultirotorKeys& keys) {
  EXPECT_EQ(keys.inertia, Vector3d(0.029125, 0.0292, 0.055225));
  EXPECT_EQ(keys.products, Vector3d(0.0001, -0.0002, 0.0003));
  ASSERT_EQ(keys.bodies.size(), 2u);
  EXPECT_EQ(keys.bodies[0].mass, 0.03);
  EXPECT_EQ(keys.bodies[0].position, Vector3d(0.01, 0.02, 0.03));
  EXPECT_EQ(keys.bodies[0].inertia, Vector3d(1e-4, 2e-4, 2.5e-4));
  EXPECT_EQ(keys.bodies[1].mass, 0.005);
  EXPECT_TRUE(keys.bodies[1].position.isZero(0.0) && keys.bodies[1].inertia.isZero(0.0));
  EXPECT_EQ(keys.pendulum, sim::Pendulum::kRigid);
  EXPECT_EQ(keys.attachment, Vector3d(0.01, -0.02, 0.05));
  ASSERT_TRUE(keys.rod.has_value() && keys.load_inertia.has_value());
  EXPECT_EQ(keys.rod->mass, 0.01);
  EXPECT_EQ(keys.rod->centre, 0.45);
  EXPECT_EQ(keys.rod->inertia, Vector3d(8.333e-4, 8.334e-4, 5e-5));
  EXPECT_EQ(*keys.load_inertia, Vector3d(1e-9, 2e-9, 3e-9));
}

void expect_px4(const Autopilot& autopilot) {
  EXPECT_EQ(autopilot.model.name, "px4");
  EXPECT_EQ(autopilot.period_ns, 2'000'000);
  const auto& keys = autopilot.own.get<sim::px4::Keys>();
  EXPECT_EQ(keys.thrust_map, sim::px4::ThrustMap::kAffine);
  ASSERT_TRUE(keys.affine_thrust.has_value());
  EXPECT_EQ(keys.affine_thrust->force, 16.0);
  EXPECT_EQ(keys.affine_thrust->thrust, 0.8);
  EXPECT_EQ(keys.affine_thrust->force_per_thrust, 21.0);
  EXPECT_EQ(keys.attitude.per_rad, Vector3d(6, 6.1, 2.9));
  EXPECT_EQ(keys.attitude.yaw_weight, 0.3);
  EXPECT_EQ(keys.attitude.rate_limits, Vector3d(3, 3.1, 3.2));
  EXPECT_EQ(keys.rates.proportional, Vector3d(0.15, 0.16, 0.21));
  EXPECT_EQ(keys.rates.integral, Vector3d(0.2, 0.21, 0.11));
  EXPECT_EQ(keys.rates.derivative, Vector3d(0.003, 0.004, 0.001));
  EXPECT_EQ(keys.rates.integral_limits, Vector3d(0.3, 0.31, 0.32));
  EXPECT_EQ(keys.rates.integral_off_error, 6.0);
  EXPECT_EQ(keys.rates.rate_cut_off, 41.0);
  EXPECT_EQ(keys.rates.derivative_cut_off, 31.0);
  ASSERT_TRUE(keys.mixer.has_value());
  ASSERT_EQ(keys.mixer->size(), 2u);
  const sim::px4::MixerRow &first = keys.mixer->front(), &second = keys.mixer->back();
  EXPECT_EQ(Vector3d(first.roll, first.pitch, first.yaw), Vector3d(-0.4, 0.7, 0.9));
  EXPECT_EQ(first.thrust, 0.95);
  EXPECT_EQ(Vector3d(second.roll, second.pitch, second.yaw), Vector3d(0.4, -0.7, -1));
  EXPECT_EQ(second.thrust, 1.0);
  EXPECT_EQ(keys.speeds.speed_at_zero, 90.0);
  EXPECT_EQ(keys.speeds.speed_per_output, 1010.0);
}

void expect_everything(const Scenario& scenario) {
  const Plant& plant = scenario.plant;
  const auto& keys = plant.own.get<MultirotorKeys>();
  expect_rotors(keys);
  expect_bodies(keys);
  EXPECT_EQ(keys.disturbance_torque, Vector3d(0.001, -0.002, 0.003));
  EXPECT_EQ(plant.disturbance_W, Vector3d(0.1, 0.2, -0.3));
  EXPECT_EQ(plant.air.v_wind_W, Vector3d(1, -2, 0.5));
  EXPECT_EQ(plant.step_ns, 500'000);
  EXPECT_EQ(plant.initial.placed, Body::kQuadrotor);
  EXPECT_EQ(plant.initial.position, Vector3d(1, 2, -3));
  ASSERT_TRUE(plant.initial.q_WB && plant.initial.w_WB_B && scenario.autopilot);
  EXPECT_EQ(plant.initial.q_WB->coeffs(), Eigen::Vector4d(0.36, -0.48, 0, 0.8));  // x, y, z, w
  EXPECT_EQ(*plant.initial.w_WB_B, Vector3d(0.4, -0.5, 0.6));
  expect_px4(*scenario.autopilot);
  EXPECT_EQ(scenario.estimator.attitude.tilt, Eigen::Vector2d(-0.0118, -0.0046));
  EXPECT_EQ(scenario.estimator.attitude.yaw, 0.055);
}

TEST(MultirotorScenarioTest, EveryKeyIsReadAndSurvivesWritingAndReading) {
  const Scenario scenario = parse_scenario(kEveryMultirotorKey, "file");
  expect_everything(scenario);
  const std::string written = to_yaml(scenario);
  const Scenario again = parse_scenario(written, "written");
  expect_everything(again);
  EXPECT_TRUE(are_equal(again, scenario)) << written;
  EXPECT_EQ(to_yaml(again), written);
}

/// `kEveryMultirotorKey` with its only occurrence of `from` replaced by `to`.
std::string with(const std::string& from, const std::string& to) {
  return replace_once(kEveryMultirotorKey, from, to);
}

TEST(MultirotorScenarioTest, ARoundedQuaternionIsMadeAUnitOne) {
  const Scenario scenario =
      parse_scenario(with("[0.8, 0.36, -0.48, 0]", "[0.70710678, 0.70710678, 0, 0]"), "file");
  EXPECT_NEAR(scenario.plant.initial.q_WB->norm(), 1.0, 1e-15);
  EXPECT_NEAR(scenario.plant.initial.q_WB->w(), std::sqrt(0.5), 1e-15);
  EXPECT_TRUE(are_equal(parse_scenario(to_yaml(scenario), "written"), scenario));
}

TEST(MultirotorScenarioTest, UnusualButValidValuesAreAllowed) {
  // Rotors without lag; all rotors with the same spin; a smallest speed equal to the largest one; a
  // flat rigid body; an attachment a rod's length from Q.
  EXPECT_EQ(find_error(with("    lag_up_s: 0.0125\n", "    lag_up_s: 0\n")), "no error");
  EXPECT_EQ(find_error(with("      lag_down_s: 0.026\n", "      lag_down_s: 0\n")), "no error");
  EXPECT_EQ(find_error(with("spin: cw", "spin: ccw")), "no error");
  EXPECT_EQ(find_error(with("    min_speed_rad_s: 100\n", "    min_speed_rad_s: 1500\n")),
            "no error");
  EXPECT_EQ(find_error(with("[1.0e-4, 2.0e-4, 2.5e-4]", "[1.0e-4, 2.0e-4, 3.0e-4]")), "no error");
  EXPECT_EQ(find_error(with("[0.01, -0.02, 0.05]", "[0, 0, 0.9]")), "no error");
}

TEST(MultirotorScenarioTest, WithoutAnAutopilotHasNone) {
  std::string text = kEveryMultirotorKey;
  const auto first = text.find("autopilot:"), last = text.find("estimator:");
  text.erase(first, last - first);
  const Scenario scenario = parse_scenario(text, "file");
  EXPECT_FALSE(scenario.autopilot.has_value());
  EXPECT_EQ(to_yaml(scenario).find("autopilot"), std::string::npos);
}

}  // namespace
}  // namespace sls::config::test
