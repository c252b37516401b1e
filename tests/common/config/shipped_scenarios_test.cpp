// The shipped scenarios have the values of the published flights. They are repeated
// here: a change of a scenario alone fails the test. The certificates of config/checks judge
// figure_eight and short.
#include <gtest/gtest.h>

#include <set>

#include "tests/common/config/support.hpp"

namespace sls::config::test {
namespace {

using Eigen::Vector3d;
using model::SlungLoadParameters;

constexpr std::int64_t kSecond = 1'000'000'000;
const SlungLoadParameters kVehicle{1.5, 0.2, 1.0, 9.8};
const SlungLoadParameters kMatlabVehicle{1.6, 0.16, 1.0, 10.0};
const SlungLoadParameters kGazeboVehicle{1.5, 0.201, 1.1, 9.8066};

Scenario load(const std::string& name) {
  return load_scenario(std::string(SLS_SOURCE_DIR) + "/config/scenarios/" + name + ".yaml");
}

void expect_lqr(const Gains& gains, double horizontal, double vertical) {
  ASSERT_TRUE(std::holds_alternative<LqrWeights>(gains));
  EXPECT_EQ(std::get<LqrWeights>(gains).horizontal, horizontal);
  EXPECT_EQ(std::get<LqrWeights>(gains).vertical, vertical);
}

void expect_named(const Gains& gains, const AxisGains& horizontal, const AxisGains& vertical) {
  NamedGains expected{horizontal, vertical};
  Scenario a, b;
  a.controller.own = QsfKeys{gains};
  b.controller.own = QsfKeys{expected};
  EXPECT_TRUE(are_equal(a, b));
}

void expect_start(const Scenario& scenario, Body placed, const Vector3d& position) {
  const InitialState& initial = scenario.plant.initial;
  EXPECT_EQ(initial.placed, placed);
  EXPECT_EQ(initial.position, position);
  EXPECT_EQ(initial.v_WQ, Vector3d(0, 0, 0));
  EXPECT_EQ(initial.rod.alpha, 0.0);
  EXPECT_EQ(initial.rod.beta, 0.0);
  EXPECT_EQ(initial.rod.alpha_dot, 0.0);
  EXPECT_EQ(initial.rod.beta_dot, 0.0);
}

void expect_timed(const Stage& stage, std::int64_t seconds) {
  ASSERT_TRUE(std::holds_alternative<LeaveAfter>(stage.leave));
  EXPECT_EQ(std::get<LeaveAfter>(stage.leave).duration_ns, seconds * kSecond);
}

void expect_constant(const Stage& stage, const std::string& kind, const Vector3d& position) {
  EXPECT_EQ(stage.kind, kind);
  ASSERT_TRUE(std::holds_alternative<ConstantReference>(stage.reference));
  EXPECT_EQ(std::get<ConstantReference>(stage.reference).position, position);
}

/// y_r = (1.5 sin 2πt/T, 0.75 sin 4πt/T, z + 0.5 sin 2πt/T), T = 16 s.
void expect_eight(const Stage& stage, double z, std::int64_t seconds) {
  EXPECT_EQ(stage.kind, "figure_eight");
  ASSERT_TRUE(std::holds_alternative<FigureEightReference>(stage.reference));
  const auto& eight = std::get<FigureEightReference>(stage.reference);
  EXPECT_EQ(eight.amplitude, Vector3d(1.5, 0.75, 0.5));
  EXPECT_EQ(eight.offset, Vector3d(0, 0, z));
  EXPECT_EQ(eight.period_s, 16.0);
  expect_timed(stage, seconds);
}

void expect_mission(const Scenario& scenario, double z, Body body, const Vector3d& offset) {
  const auto& mission = scenario.mission;
  ASSERT_EQ(mission.size(), 6u);
  expect_constant(mission[0], "hold", {0, 0, -1.5});
  expect_timed(mission[0], 10);
  expect_constant(mission[1], "set_point", {1, -1, -2});
  expect_constant(mission[2], "set_point", {-2, -1, -4});
  expect_constant(mission[3], "set_point", {1, 2, -3});
  for (int i = 1; i <= 3; ++i) {
    const auto* leave = std::get_if<LeaveUntil>(&mission[static_cast<std::size_t>(i)].leave);
    ASSERT_NE(leave, nullptr);
    EXPECT_EQ(leave->after_ns, 15 * kSecond);
    EXPECT_EQ(leave->radius_m, 0.2);
    EXPECT_EQ(leave->body, body);
    EXPECT_EQ(leave->offset, offset);
  }
  expect_eight(mission[4], z, 32);
  expect_constant(mission[5], "set_point", {0, 0, -1.5});
  expect_timed(mission[5], 15);
}

TEST(ShippedScenariosTest, ShareTimingAndBearTheirFilesName) {
  const std::set<std::string> at_50_hz{"px4_fitted", "px4_hold", "px4_published"};
  for (const auto& file : list_yaml_files("config/scenarios")) {
    SCOPED_TRACE(file);
    const Scenario scenario = load_scenario(file);
    EXPECT_EQ(scenario.name, file.stem().string());
    EXPECT_EQ(scenario.sync.mode, SyncMode::kLockstep);
    EXPECT_EQ(scenario.sync.period_ns, at_50_hz.count(scenario.name) ? 20'000'000 : 4'000'000);
    EXPECT_EQ(scenario.plant.step_ns, 1'000'000);
    EXPECT_EQ(scenario.sync.wait_for.controllers, 1);
    EXPECT_EQ(scenario.sync.wait_for.recorders, 1);
    EXPECT_EQ(scenario.sync.wait_for.timeout_s, 30.0);
    EXPECT_EQ(scenario.controller.force_limit_n, 200.0);
    EXPECT_FALSE(scenario.controller.saturate);
    EXPECT_EQ(scenario.plant.disturbance_W, Vector3d(0, 0, 0));
  }
}

TEST(ShippedScenariosTest, FitAOneMillisecondPeriod) {
  for (const auto& file : list_yaml_files("config/scenarios")) {
    Scenario scenario = load_scenario(file);
    EXPECT_NO_THROW(override_period(scenario, 0.001)) << file;
  }
}

TEST(ShippedScenariosTest, ControllerModelEqualsThePlantExceptWhereTheTableDiffers) {
  const std::set<std::string> mistaken{"gazebo_legacy",       "gazebo_correct_wiring",
                                       "integral_mass_error", "mass_error_without_integral",
                                       "px4_fitted",          "px4_published"};
  for (const auto& file : list_yaml_files("config/scenarios")) {
    const Scenario scenario = load_scenario(file);
    const bool knows = scenario.controller.model.vehicle == scenario.vehicle;
    EXPECT_EQ(knows, mistaken.count(scenario.name) == 0) << file;
    EXPECT_EQ(scenario.controller.model.air, scenario.plant.air) << file;
    const bool miswired = scenario.controller.state_wiring != StateWiring::kCorrect;
    EXPECT_EQ(miswired, scenario.name == "gazebo_legacy") << file;
  }
}

TEST(ShippedScenariosTest, Setpoints) {
  const Scenario scenario = load("setpoints");
  EXPECT_EQ(scenario.vehicle, kVehicle);
  expect_lqr(gains_of(scenario), 10, 5);
  expect_start(scenario, Body::kLoad, {0, 0, -1.5});
  ASSERT_EQ(scenario.mission.size(), 3u);
  expect_constant(scenario.mission[0], "set_point", {1, -1, -2});
  expect_constant(scenario.mission[1], "set_point", {-1, -1, -4});
  expect_constant(scenario.mission[2], "set_point", {1, 1, -3});
  for (const Stage& stage : scenario.mission) expect_timed(stage, 15);
}

TEST(ShippedScenariosTest, Mission) {
  const Scenario scenario = load("mission");
  EXPECT_EQ(scenario.vehicle, kVehicle);
  expect_lqr(gains_of(scenario), 10, 5);
  expect_start(scenario, Body::kQuadrotor, {0, 0, 0});
  expect_mission(scenario, -0.5, Body::kLoad, {0, 0, 0});
}

TEST(ShippedScenariosTest, MatlabSetPoints) {
  const Vector3d points[] = {{0, 0, -1.5}, {1, -1, -2}, {-2, -1, -4}, {1, 2, -3}};
  for (std::size_t i = 1; i <= 3; ++i) {
    const Scenario scenario = load("matlab_setpoint_" + std::to_string(i));
    SCOPED_TRACE(scenario.name);
    EXPECT_EQ(scenario.vehicle, kMatlabVehicle);
    expect_named(gains_of(scenario), {34.021, 78.729, 77.326, 31.623, 0},
                 {8.0089, 7.0711, 0, 0, 0});
    expect_start(scenario, Body::kLoad, points[i - 1]);
    ASSERT_EQ(scenario.mission.size(), 1u);
    expect_constant(scenario.mission[0], "set_point", points[i]);
    expect_timed(scenario.mission[0], 15);
  }
}

TEST(ShippedScenariosTest, MatlabFigureEight) {
  const Scenario scenario = load("matlab_figure_eight");
  EXPECT_EQ(scenario.vehicle, kMatlabVehicle);
  expect_lqr(gains_of(scenario), 10, 5);
  expect_start(scenario, Body::kQuadrotor, {1, 2, -4});
  ASSERT_EQ(scenario.mission.size(), 1u);
  expect_eight(scenario.mission[0], -0.5, 32);
}

TEST(ShippedScenariosTest, GazeboLegacyAndItsRepairs) {
  for (const std::string name : {"gazebo_legacy", "gazebo_correct_wiring", "gazebo_corrected"}) {
    SCOPED_TRACE(name);
    const Scenario scenario = load(name);
    EXPECT_EQ(scenario.vehicle, kGazeboVehicle);
    EXPECT_EQ(scenario.plant.own.get<sim::SlungLoadKeys>().pendulum, sim::Pendulum::kIdeal);
    EXPECT_EQ(scenario.controller.model.vehicle,
              name == "gazebo_corrected" ? kGazeboVehicle : kVehicle);
    expect_named(gains_of(scenario), {5.4399, 9.7962, 8.4827, 3.1623, 0},
                 {3.0777, 2.2361, 0, 0, 0});
    expect_start(scenario, Body::kQuadrotor, {0, 0, 0});
    expect_mission(scenario, -0.6, Body::kQuadrotor, {0, 0, -0.95});
  }
}

TEST(ShippedScenariosTest, RestToRest) {
  const Scenario scenario = load("rest_to_rest");
  EXPECT_EQ(scenario.vehicle, kVehicle);
  expect_start(scenario, Body::kLoad, {0, 0, -1.5});
  ASSERT_EQ(scenario.mission.size(), 2u);
  Vector3d at(0, 0, -1.5);
  for (const Stage& stage : scenario.mission) {  // each leg begins where the load rests
    const auto& leg = std::get<RestToRestReference>(stage.reference);
    EXPECT_EQ(leg.from, at);
    EXPECT_EQ(leg.duration_s, 8.0);
    expect_timed(stage, 10);
    at = leg.to;
  }
}

TEST(ShippedScenariosTest, RigidFigureEight) {
  const Scenario scenario = load("rigid_figure_eight");
  EXPECT_EQ(scenario.plant.own.get<sim::SlungLoadKeys>().pendulum, sim::Pendulum::kRigid);
  EXPECT_EQ(scenario.vehicle, (SlungLoadParameters{1.5, 0.201, 1.1, 9.8}));
  ASSERT_EQ(scenario.mission.size(), 1u);
  expect_eight(scenario.mission[0], -0.5, 32);
}

TEST(ShippedScenariosTest, IntegralMassError) {
  const Scenario scenario = load("integral_mass_error");
  EXPECT_EQ(scenario.vehicle, kVehicle);
  EXPECT_EQ(scenario.controller.model.vehicle, (SlungLoadParameters{1.5, 0.21, 1.0, 9.8}));
  expect_named(gains_of(scenario), {3.2469, 8.5803, 9.8503, 5.4498, 0.0316},
               {2.2667, 3.0876, 0, 0, 0.0224});
}

TEST(ShippedScenariosTest, RotorDrag) {
  const Scenario scenario = load("rotor_drag");
  EXPECT_GT(scenario.plant.air.rotor_drag, 0.0);
  EXPECT_TRUE(scenario.controller.drag_feed_forward);
  ASSERT_EQ(scenario.mission.size(), 1u);
  expect_eight(scenario.mission[0], -0.5, 32);
}

TEST(ShippedScenariosTest, MassErrorWithoutIntegralLacksNothingElse) {
  const Scenario with = load("integral_mass_error"), without = load("mass_error_without_integral");
  EXPECT_EQ(without.vehicle, with.vehicle);
  EXPECT_EQ(without.controller.model.vehicle, with.controller.model.vehicle);
  expect_named(gains_of(without), {3.2469, 8.5803, 9.8503, 5.4498, 0}, {2.2667, 3.0876, 0, 0, 0});
  expect_start(without, Body::kLoad, {0, 0, -1.5});
  for (const Scenario* scenario : {&with, &without}) {
    ASSERT_EQ(scenario->mission.size(), 1u);
    expect_constant(scenario->mission[0], "set_point", {1, -1, -2});
    expect_timed(scenario->mission[0], 300);
  }
}

TEST(ShippedScenariosTest, RotorDragWithoutFeedForwardLacksNothingElse) {
  const Scenario with = load("rotor_drag"), without = load("rotor_drag_without_feed_forward");
  EXPECT_EQ(without.vehicle, with.vehicle);
  EXPECT_EQ(without.plant.air, with.plant.air);
  EXPECT_FALSE(without.controller.drag_feed_forward);
  expect_lqr(gains_of(without), 10, 5);
  expect_start(without, Body::kLoad, {0, 0, -0.5});
  ASSERT_EQ(without.mission.size(), 1u);
  expect_eight(without.mission[0], -0.5, 32);
}

TEST(ShippedScenariosTest, FaultyFigureEightShowsEveryKindOfFault) {
  const Scenario scenario = load("faulty_figure_eight");
  EXPECT_EQ(scenario.vehicle, kVehicle);
  expect_lqr(gains_of(scenario), 10, 5);
  ASSERT_EQ(scenario.mission.size(), 1u);
  expect_eight(scenario.mission[0], -0.5, 32);
  std::set<std::string> kinds;
  for (const Fault& fault : scenario.faults) kinds.insert(fault.kind);
  EXPECT_EQ(kinds, (std::set<std::string>{"bias", "delay", "drop", "freeze", "noise", "reorder"}));
}

TEST(ShippedScenariosTest, OnlyTheFaultyOneHasFaults) {
  for (const auto& file : list_yaml_files("config/scenarios")) {
    const Scenario scenario = load_scenario(file);
    EXPECT_EQ(scenario.faults.empty(), scenario.name != "faulty_figure_eight") << file;
  }
}

TEST(ShippedScenariosTest, OnlyTheFleetsHaveMoreThanOneVehicle) {
  for (const auto& file : list_yaml_files("config/scenarios")) {
    const Scenario scenario = load_scenario(file);
    const std::map<std::string, std::size_t> fleets{{"cable_cut", 4},
                                                    {"fleet", 10},
                                                    {"four_carry_a_box", 4},
                                                    {"mixed_fleet", 4},
                                                    {"one_controller_dies", 3},
                                                    {"rotors_carry_a_triangle", 3},
                                                    {"six_carry_a_box", 6},
                                                    {"three_carry_a_triangle", 3},
                                                    {"three_carry_a_triangle_pose", 3},
                                                    {"two_carry_a_bar", 2}};
    const auto fleet = fleets.find(scenario.name);
    EXPECT_EQ(scenario.vehicles.size(), fleet == fleets.end() ? 1 : fleet->second) << file;
    if (scenario.plant.model.name == "cables") continue;  // whose offsets are attachments
    EXPECT_EQ(scenario.vehicles[0].offset, Vector3d(0, 0, 0)) << file;
  }
}

TEST(ShippedScenariosTest, Fleet) {
  const Scenario scenario = load("fleet");
  EXPECT_EQ(scenario.vehicle, kVehicle);
  expect_start(scenario, Body::kLoad, {0, 0, -0.5});
  ASSERT_EQ(scenario.mission.size(), 1u);
  expect_eight(scenario.mission[0], -0.5, 16);
}

TEST(ShippedScenariosTest, MixedFleetHasFourDifferentVehicles) {
  const Scenario scenario = load("mixed_fleet");
  EXPECT_EQ(scenario.vehicle, kVehicle);
  ASSERT_EQ(scenario.vehicles.size(), 4u);
  for (std::uint32_t a = 0; a < 4; ++a)
    for (std::uint32_t b = 0; b < a; ++b)
      EXPECT_FALSE(make_vehicle_scenario(scenario, a).vehicle ==
                   make_vehicle_scenario(scenario, b).vehicle)
          << a << " " << b;
}

}  // namespace
}  // namespace sls::config::test
