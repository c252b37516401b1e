// The shipped scenarios have the values of the published flights. They are repeated
// here: a change of a scenario alone fails the test. The certificates of config/checks judge
// figure_eight and short.
#include <gtest/gtest.h>

#include <map>
#include <set>

#include "common/config/scenario_draft.hpp"
#include "tests/common/config/support.hpp"

namespace sls::config::test {
namespace {

using Eigen::Vector3d;

const std::string kFolder = SLS_SOURCE_DIR "/config/scenarios/";

Scenario load(const std::string& name) { return load_scenario(kFolder + name + ".yaml"); }

TEST(ShippedScenariosTest, ShareTimingAndBearTheirFilesName) {
  const std::set<std::string> at_50_hz{"px4_fitted", "px4_hold", "px4_published"};
  for (const auto& file : list_yaml_files("config/scenarios")) {
    SCOPED_TRACE(file);
    const Scenario scenario = load_scenario(file);
    EXPECT_EQ(scenario.name, file.stem().string());
    EXPECT_EQ(scenario.sync.mode, SyncMode::kLockstep);
    EXPECT_EQ(scenario.sync.period_ns, at_50_hz.count(scenario.name) ? 20'000'000 : 4'000'000);
    EXPECT_EQ(scenario.plant.step_ns, 1'000'000);
    EXPECT_EQ(scenario.warnings, std::vector<std::string>());
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

std::string set_point(const char* position, const char* leave) {
  return std::string("{ set_point: { position_m: ") + position + " }, " + leave + " }";
}
std::string make_mission(const char* z, const std::string& of) {
  const std::string until = "until: { after_s: 15, within_m: 0.2" + of + " }";
  return "[{ hold: { position_m: [0, 0, -1.5] }, for_s: 10 }, " +
         set_point("[1, -1, -2]", until.c_str()) + ", " + set_point("[-2, -1, -4]", until.c_str()) +
         ", " + set_point("[1, 2, -3]", until.c_str()) +
         ", { figure_eight: { amplitude_m: [1.5, 0.75, 0.5], offset_m: [0, 0, " + z +
         "], period_s: 16 }, for_s: 32 }, " + set_point("[0, 0, -1.5]", "for_s: 15") + "]";
}

TEST(ShippedScenariosTest, HaveTheValuesOfTheDesign) {
  using Edits = std::vector<std::pair<const char*, std::string>>;
  const std::string kRest = "{ load_position_m: [0, 0, -1.5] }";
  const std::string kOrigin = "{ quad_position_m: [0, 0, 0] }";
  const std::string kGazebo =
      "{ quad_mass_kg: 1.5, load_mass_kg: 0.201, rod_length_m: 1.1, gravity_m_s2: 9.8066 }";
  const std::string kMatlab =
      "{ quad_mass_kg: 1.6, load_mass_kg: 0.16, rod_length_m: 1, gravity_m_s2: 10 }";
  const std::string kMatlabGains =
      "{ horizontal: { position: 34.021, velocity: 78.729, acceleration: 77.326, jerk: 31.623 }, "
      "vertical: { position: 8.0089, velocity: 7.0711 } }";
  const std::string kGazeboGains =
      "{ horizontal: { position: 5.4399, velocity: 9.7962, acceleration: 8.4827, jerk: 3.1623 }, "
      "vertical: { position: 3.0777, velocity: 2.2361 } }";
  const std::string kGazeboMission =
      make_mission("-0.6", ", of: quadrotor, offset_m: [0, 0, -0.95]");
  const std::string kBelieved =
      "{ quad_mass_kg: 1.5, load_mass_kg: 0.2, rod_length_m: 1, gravity_m_s2: 9.8 }";
  const std::string kIntegralGains =
      "{ horizontal: { position: 3.2469, velocity: 8.5803, acceleration: 9.8503, jerk: 5.4498, "
      "integral: 0.0316 }, vertical: { position: 2.2667, velocity: 3.0876, integral: 0.0224 } }";
  const std::string kSameGains =
      "{ horizontal: { position: 3.2469, velocity: 8.5803, acceleration: 9.8503, jerk: 5.4498 }, "
      "vertical: { position: 2.2667, velocity: 3.0876 } }";
  const Edits kDrag = {{"plant.rotor_drag_n_s_m", "0.3"}, {"plant.wind_m_s", "[2, -1, 0]"}};
  const auto to_point = [](const char* position, const char* leave) {
    return "[" + set_point(position, leave) + "]";
  };
  // Where they differ from figure_eight.
  const std::vector<std::pair<const char*, Edits>> rows = {
      {"setpoints",
       {{"plant.initial", kRest},
        {"mission", "[" + set_point("[1, -1, -2]", "for_s: 15") + ", " +
                        set_point("[-1, -1, -4]", "for_s: 15") + ", " +
                        set_point("[1, 1, -3]", "for_s: 15") + "]"}}},
      {"mission", {{"plant.initial", kOrigin}, {"mission", make_mission("-0.5", "")}}},
      {"matlab_setpoint_1",
       {{"vehicle", kMatlab},
        {"controller.gains", kMatlabGains},
        {"plant.initial", kRest},
        {"mission", to_point("[1, -1, -2]", "for_s: 15")}}},
      {"matlab_setpoint_2",
       {{"vehicle", kMatlab},
        {"controller.gains", kMatlabGains},
        {"plant.initial", "{ load_position_m: [1, -1, -2] }"},
        {"mission", to_point("[-2, -1, -4]", "for_s: 15")}}},
      {"matlab_setpoint_3",
       {{"vehicle", kMatlab},
        {"controller.gains", kMatlabGains},
        {"plant.initial", "{ load_position_m: [-2, -1, -4] }"},
        {"mission", to_point("[1, 2, -3]", "for_s: 15")}}},
      {"matlab_figure_eight",
       {{"vehicle", kMatlab}, {"plant.initial", "{ quad_position_m: [1, 2, -4] }"}}},
      {"gazebo_legacy",
       {{"vehicle", kGazebo},
        {"controller.gains", kGazeboGains},
        {"controller.model", kBelieved},
        {"controller.state_wiring", "gazebo_plugin"},
        {"plant.initial", kOrigin},
        {"mission", kGazeboMission}}},
      {"gazebo_correct_wiring",
       {{"vehicle", kGazebo},
        {"controller.gains", kGazeboGains},
        {"controller.model", kBelieved},
        {"plant.initial", kOrigin},
        {"mission", kGazeboMission}}},
      {"gazebo_corrected",
       {{"vehicle", kGazebo},
        {"controller.gains", kGazeboGains},
        {"plant.initial", kOrigin},
        {"mission", kGazeboMission}}},
      {"rest_to_rest",
       {{"plant.initial", kRest},
        {"mission",
         "[{ rest_to_rest: { from_m: [0, 0, -1.5], to_m: [3, -2, -3], duration_s: 8 }, name: "
         "there, "
         "for_s: 10 }, { rest_to_rest: { from_m: [3, -2, -3], to_m: [0, 0, -1.5], duration_s: 8 }, "
         "name: back, for_s: 10 }]"}}},
      {"rigid_figure_eight",
       {{"vehicle.load_mass_kg", "0.201"},
        {"vehicle.rod_length_m", "1.1"},
        {"plant.pendulum", "rigid"}}},
      {"integral_mass_error",
       {{"controller.gains", kIntegralGains},
        {"controller.model.load_mass_kg", "0.21"},
        {"plant.initial", kRest},
        {"mission", to_point("[1, -1, -2]", "for_s: 300")}}},
      {"mass_error_without_integral",
       {{"controller.gains", kSameGains},
        {"controller.model.load_mass_kg", "0.21"},
        {"plant.initial", kRest},
        {"mission", to_point("[1, -1, -2]", "for_s: 300")}}},
      {"rotor_drag", {kDrag[0], kDrag[1], {"controller.drag_feed_forward", "true"}}},
      {"rotor_drag_without_feed_forward", kDrag},
      {"fleet", {{"vehicles", "10"}, {"mission.0.for_s", "16"}}}};
  for (const auto& [name, edits] : rows) {
    ScenarioDraft expected(kFolder + "figure_eight.yaml");
    expected.set("name", name);
    for (const auto& [path, value] : edits) expected.set(path, value);
    EXPECT_EQ(to_yaml(load(name)), to_yaml(expected.make_scenario())) << name;
  }
}

TEST(ShippedScenariosTest, FaultyFigureEightShowsEveryKindOfFault) {
  Scenario scenario = load("faulty_figure_eight");
  std::set<std::string> kinds;
  for (const Fault& fault : scenario.faults) kinds.insert(fault.kind);
  EXPECT_EQ(kinds, (std::set<std::string>{"bias", "delay", "drop", "freeze", "noise", "reorder"}));
  scenario.name = "figure_eight";
  scenario.plant.initial.v_WQ.setZero();
  scenario.faults.clear();
  EXPECT_TRUE(are_equal(scenario, load("figure_eight"))) << "nothing else differs";
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

TEST(ShippedScenariosTest, MixedFleetHasFourDifferentVehicles) {
  const Scenario scenario = load("mixed_fleet");
  EXPECT_EQ(scenario.vehicle, load("figure_eight").vehicle);
  ASSERT_EQ(scenario.vehicles.size(), 4u);
  for (std::uint32_t a = 0; a < 4; ++a)
    for (std::uint32_t b = 0; b < a; ++b)
      EXPECT_FALSE(make_vehicle_scenario(scenario, a).vehicle ==
                   make_vehicle_scenario(scenario, b).vehicle)
          << a << " " << b;
}

}  // namespace
}  // namespace sls::config::test
