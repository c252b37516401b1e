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

/// The scenario of `kEveryMultirotorKey`.
Scenario make_every_key() {
  Scenario scenario;
  scenario.name = "everything";
  scenario.vehicle = {1.55, 0.15, 0.9, 9.8066};

  MultirotorKeys keys;
  keys.inertia << 0.029125, 0.0292, 0.055225;
  keys.products << 0.0001, -0.0002, 0.0003;
  keys.rotor = {5.1e-6, 0.05, 8e-5, 1e-6, 100, 1500, 0.0125, 0.025, 25};
  const sim::RotorNumbers<std::optional<double>> own{5.2e-6, 0.06,  9e-5,  2e-6, 110,
                                                     1600,   0.013, 0.026, 26};
  keys.rotors = {
      {Vector3d(0.13, 0.22, -0.01), Vector3d(0.1, 0, -2), sim::Spin::kCounterClockwise, 1.0, {}},
      {Vector3d(-0.13, -0.2, 0), -Vector3d::UnitZ(), sim::Spin::kClockwise, 0.9, own}};
  keys.bodies.resize(2);
  keys.bodies[0] = {0.03, Vector3d(0.01, 0.02, 0.03), Vector3d(1e-4, 2e-4, 2.5e-4)};
  keys.bodies[1].mass = 0.005;
  keys.disturbance_torque << 0.001, -0.002, 0.003;
  keys.pendulum = sim::Pendulum::kRigid;
  keys.attachment << 0.01, -0.02, 0.05;
  keys.rod = sim::RodKeys{0.01, 0.45, Vector3d(8.333e-4, 8.334e-4, 5e-5)};
  keys.load_inertia = Vector3d(1e-9, 2e-9, 3e-9);

  Plant& plant = scenario.plant;
  plant.model.name = "multirotor";
  plant.own = keys;
  plant.step_ns = 500'000;
  plant.initial.placed = Body::kQuadrotor;
  plant.initial.position << 1, 2, -3;
  plant.initial.q_WB = Eigen::Quaterniond(0.8, 0.36, -0.48, 0);
  plant.initial.w_WB_B = Vector3d(0.4, -0.5, 0.6);
  plant.air.v_wind_W << 1, -2, 0.5;
  scenario.controller.model = {scenario.vehicle, plant.air, {true, true, true}};
  plant.disturbance_W << 0.1, 0.2, -0.3;

  sim::px4::Keys px4;
  px4.thrust_map = sim::px4::ThrustMap::kAffine;
  px4.affine_thrust = sim::px4::AffineThrust{16, 0.8, 21};
  px4.attitude = {Vector3d(6, 6.1, 2.9), 0.3, Vector3d(3, 3.1, 3.2)};
  px4.rates = {Vector3d(0.15, 0.16, 0.21),
               Vector3d(0.2, 0.21, 0.11),
               Vector3d(0.003, 0.004, 0.001),
               Vector3d(0.3, 0.31, 0.32),
               6,
               41,
               31};
  px4.mixer = {{-0.4, 0.7, 0.9, 0.95}, {0.4, -0.7, -1, 1}};
  px4.speeds = {90, 1010};
  scenario.autopilot = Autopilot{{"px4", ""}, px4, 2'000'000};
  scenario.estimator.attitude = {Eigen::Vector2d(-0.0118, -0.0046), 0.055};
  scenario.mission = {
      {"hold", "hold", ConstantReference{Vector3d(1, 2, -3)}, LeaveAfter{1'000'000'000}}};
  return scenario;
}

TEST(MultirotorScenarioTest, ReadsAndWritesEveryKey) {
  expect_every_key(kEveryMultirotorKey, make_every_key());
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
