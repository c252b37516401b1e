// Keys that a file sets, and the defaults of the other keys.
#include "common/config/scenario.hpp"

#include <gtest/gtest.h>

#include "tests/common/config/support.hpp"

namespace sls::config::test {
namespace {

using Eigen::Vector3d;

// The example of the project's design, section 7, unchanged.
constexpr const char* kDesignExample = R"(name: figure_eight
vehicle: { quad_mass_kg: 1.5, load_mass_kg: 0.2, rod_length_m: 1.0, gravity_m_s2: 9.8 }
plant:
  pendulum: ideal                       # or rigid
  step_s: 0.001
  initial: { load_position_m: [0, 0, -0.5] }     # or quad_position_m; angles and velocities default to rest
sync: { mode: lockstep, period_s: 0.004, wait_for: { controllers: 1, recorders: 1, timeout_s: 30 } }
controller:
  gains: { lqr: { horizontal: 10, vertical: 5 } }   # or horizontal: { position, velocity, acceleration, jerk, integral }, vertical: …
  force_limit_n: 200                    # the first step of matlab_setpoint_3 needs 116 N
  model: {}                             # what the controller assumes, where it differs from vehicle
mission:
  - figure_eight: { amplitude_m: [1.5, 0.75, 0.5], offset_m: [0, 0, -0.5], period_s: 16 }
    for_s: 32
)";

TEST(ScenarioTest, ReadsTheExampleOfTheDesign) {
  const Scenario scenario = parse_scenario(kDesignExample, "file");
  EXPECT_EQ(scenario.name, "figure_eight");
  EXPECT_EQ(scenario.vehicle, (model::SlungLoadParameters{1.5, 0.2, 1.0, 9.8}));
  EXPECT_EQ(scenario.controller.model.vehicle, scenario.vehicle);
  EXPECT_EQ(scenario.plant.initial.placed, Body::kLoad);
  EXPECT_EQ(scenario.plant.initial.position, Vector3d(0, 0, -0.5));
  EXPECT_EQ(scenario.text, kDesignExample);
}

TEST(ScenarioTest, WarnsOfWhatIsAllowedButHardlyMeant) {
  std::string text = replace_once(kDesignExample, "rod_length_m: 1.0", "rod_length_m: 0.01");
  text = replace_once(text, "step_s: 0.001", "step_s: 0.01");
  text = replace_once(text, "period_s: 0.004", "period_s: 0.02");
  EXPECT_EQ(parse_scenario(text, "file").warnings,
            (std::vector<std::string>{"file:5: plant.step_s: expected at most 0.007501 for a swing "
                                      "of 33.3 rad/s, got 0.01: the swing loses energy"}));
  text = read_bytes(SLS_SOURCE_DIR "/config/scenarios/lift_and_set_down.yaml");
  text = replace_once(text, "retaut_rate_m_s: 2", "retaut_rate_m_s: 0.5");
  EXPECT_EQ(parse_scenario(text, "file").warnings,
            (std::vector<std::string>{
                "file:15: controller.retaut_rate_m_s: expected at least 2, got 0.5: a load that "
                "falls by its whole cable is caught 20.1 m lower"}));
}

/// The scenario of `kEveryKey`.
Scenario make_every_key() {
  Scenario scenario;
  scenario.name = "every_key";
  scenario.vehicle = {1.6, 0.16, 0.7, 10.0};
  scenario.vehicles = {{Vector3d(1, 2, 3), 1.8, 0.18, 0.9, 0.95, Vector3d(0.3, 0.2, 0.1), {}, {}}, {}};

  Plant& plant = scenario.plant;
  plant.own = sim::SlungLoadKeys{sim::Pendulum::kIdeal};
  plant.step_ns = 500'000;
  plant.initial.placed = Body::kQuadrotor;
  plant.initial.position << 1, 2, -4;
  plant.initial.v_WQ << 0.1, 0.2, 0.3;
  plant.initial.rod = {0.4, -0.5, 0.6, -0.7};
  plant.air = {0.3, Vector3d(2, -1, 0.5)};
  plant.wind.gusts = {{3'000'000'000, 500'000'000, 2'000'000'000, Vector3d(1, 0, -1)},
                      {4'000'000'000, 0, {}, Vector3d(0, 1, 0)}};
  plant.wind.turbulence = Turbulence{20.0, 7.7, 5};
  plant.load_drag = {0.1, 0.02, 1.1};
  plant.thrust = {0.925, -0.001, Battery{16.8, 14.0, 0.02, 5.0, 250.0},
                  {{2'000'000'000, 1, {}, 0.5}, {3'000'000'000, 0, {}, 0.0}}};
  plant.disturbance_W << 0.1, 0, -0.1;

  scenario.sync = {SyncMode::kRealtime, 2'000'000, 2.5, 0.25, 0.75, {2, 0, 7.5}, {}};
  scenario.sync.wait = {{ControllerPolicy::kHold, 0.5}, {RecorderPolicy::kGoOn, 0.6}, 12.0};

  Controller& controller = scenario.controller;
  controller.own = QsfKeys{NamedGains{{1, 2, 3, 4, 5}, {6, 7, 0, 0, 8}}};
  controller.force_limit_n = 50;
  controller.saturate = controller.drag_feed_forward = true;
  controller.state_wiring = StateWiring::kGazeboPlugin;
  controller.model = {{1.7, 0.17, 0.8, 9.9}, {0.4, Vector3d(3, -2, 1)}, {}};

  LeaveUntil within, by_default;
  within.radius_m = 0.3;
  within.after_ns = 4'000'000'000;
  within.body = Body::kQuadrotor;
  within.offset << 0, 0, -0.95;
  within.timeout_ns = 9'000'000'000;
  by_default.radius_m = 0.4;
  by_default.after_ns = 5'000'000'000;
  by_default.timeout_ns = 65'000'000'000;
  scenario.mission = {
      {"hold", "first", ConstantReference{Vector3d(0, 0, -1)}, LeaveAfter{1'000'000'000}},
      {"set_point", "set_point", ConstantReference{Vector3d(1, 0, -1)}, within},
      {"figure_eight", "figure_eight",
       FigureEightReference{Vector3d(1, 2, 3), Vector3d(4, 5, 6), 12.0}, by_default},
      {"rest_to_rest", "rest_to_rest",
       RestToRestReference{Vector3d(1, 1, 1), Vector3d(2, 2, 2), 3.0}, LeaveAfter{4'000'000'000}}};

  const SampleOffset bias{
      {Vector3d(0.1, 0.2, 0.3), Vector3d(0.4, 0.5, 0.6), {0.02, -0.03, 0.04, -0.05}}};
  const SampleOffset noise{
      {Vector3d(0.01, 0.02, 0.03), Vector3d(0.04, 0.05, 0.06), {0.07, 0.08, 0.09, 0.1}}};
  const auto kState = FaultChannel::kState, kCommand = FaultChannel::kCommand;
  scenario.faults = {{"delay", DelayFault{20'000'000}, kCommand, 1, 1'000'000'000, 2'000'000'000},
                     {"drop", DropFault{0.2, 7}, kState, 0, 4'000'000'000, 8'000'000'000},
                     {"freeze", FreezeFault{}, kState, 0, 5'000'000'000, 5'200'000'000},
                     {"reorder", ReorderFault{0.1, 9223372036854775807}, kCommand},
                     {"bias", BiasFault{bias}, kState},
                     {"bias", BiasFault{{{}, Vector3d(0, 0, 1)}}, kCommand},
                     {"noise", NoiseFault{noise, 3}, kState},
                     {"noise", NoiseFault{{{}, Vector3d(0.1, 0, 0)}}, kCommand}};

  scenario.sensing = {{33'333'333, 20'000'000}, {20'000'000, 11'000'000}, 10'500'000};
  scenario.estimator = {Vector3d(0.1, 0.2, 0.3), Vector3d(0.4, 0.5, 0.6), {}};
  scenario.record = {0.05, {RecordFormat::kCsv, RecordFormat::kMcap}};
  return scenario;
}

TEST(ScenarioTest, ReadsAndWritesEveryKey) { expect_every_key(kEveryKey, make_every_key()); }

TEST(ScenarioTest, ReadsConditionsOnCableAndLoadAndWritesThem) {
  const Scenario scenario = parse_scenario(R"(
name: lift
vehicle: { quad_mass_kg: 1.5, load_mass_kg: 0.2, rod_length_m: 1.0, gravity_m_s2: 9.8 }
plant: { model: cables, cables: [{ distance_m: 1 }], ground_z_m: 0, initial: { load_position_m: [0, 0, 0] } }
controller: { retaut_rate_m_s: 1.5 }
mission:
  - { hold: { position_m: [0, 0, 0] }, until: { cable: slack } }
  - { hold: { position_m: [0, 0, 0] }, until: { load: off_ground, after_s: 2 } }
  - { hold: { position_m: [0, 0, 0] }, until: { tension_above_n: 1.5 } }
  - { hold: { position_m: [0, 0, 0] }, until: { tension_below_n: 0.5, timeout_s: 3 } }
)",
                                           "file");
  using Condition = LeaveUntil::Condition;
  const auto again = parse_scenario(to_yaml(scenario), "again").mission;
  for (const auto& mission : {scenario.mission, again}) {
    const auto at = [&](std::size_t i) { return std::get<LeaveUntil>(mission.at(i).leave); };
    EXPECT_EQ(at(0).condition, Condition::kCable);
    EXPECT_EQ(at(0).cable, CableState::kSlack);
    EXPECT_EQ(at(0).timeout_ns, 60'000'000'000);
    EXPECT_EQ(at(1).condition, Condition::kLoad);
    EXPECT_EQ(at(1).load, LoadPlace::kOffGround);
    EXPECT_EQ(at(1).after_ns, 2'000'000'000);
    EXPECT_EQ(at(2).condition, Condition::kTensionAbove);
    EXPECT_EQ(at(2).tension_n, 1.5);
    EXPECT_EQ(at(3).condition, Condition::kTensionBelow);
    EXPECT_EQ(at(3).tension_n, 0.5);
    EXPECT_EQ(at(3).timeout_ns, 3'000'000'000);
  }
}

TEST(ScenarioTest, TheRodIsSampledAsTheRestWhereTheFileIsSilent) {
  const auto read = [](const std::string& sensing) {
    return parse_scenario(std::string(kMinimalScenario) + "sensing: " + sensing + "\n", "file")
        .sensing;
  };
  const Sensing silent = read("{ period_s: 0.03, age_s: 0.02 }");
  EXPECT_EQ(silent.rod.period_ns, 30'000'000);
  EXPECT_EQ(silent.rod.age_ns, 20'000'000);
  const Sensing own_age = read("{ rod: { age_s: 0.01 }, age_s: 0.02, period_s: 0.03 }");
  EXPECT_EQ(own_age.rod.period_ns, 30'000'000);
  EXPECT_EQ(own_age.rod.age_ns, 10'000'000);
  const Sensing own_period = read("{ rod: { period_s: 0 }, age_s: 0.02, period_s: 0.03 }");
  EXPECT_EQ(own_period.rod.period_ns, 0);
  EXPECT_EQ(own_period.rod.age_ns, 20'000'000);
}

TEST(ScenarioTest, AnAttitudeErrorNeedsAPlantWithAnAttitudeWhichALibraryMayHave) {
  const auto with = [](const char* model) {
    return replace_once(std::string(kMinimalScenario) +
                            "estimator: { tilt_rad: [-0.0118, -0.0046], yaw_rad: 0.055 }\n",
                        "plant:\n", std::string("plant:\n  model: ") + model + "\n");
  };
  const Scenario scenario = parse_scenario(with("./mine.so"), "file");
  EXPECT_EQ(scenario.estimator.attitude.tilt, Eigen::Vector2d(-0.0118, -0.0046));
  EXPECT_EQ(scenario.estimator.attitude.yaw, 0.055);
  EXPECT_TRUE(are_equal(parse_scenario(to_yaml(scenario), "file"), scenario));
  EXPECT_EQ(find_error(with("analytic")),
            "file:13: estimator.tilt_rad: expected a plant with an attitude, or 0; model is "
            "'analytic', got [-0.0118, -0.0046]");
}

TEST(ScenarioTest, AFaultLastsFromStartToEndWhereTheFileIsSilent) {
  const std::string text = std::string(kMinimalScenario) + "faults: [ { freeze: { on: state } } ]";
  const Scenario scenario = parse_scenario(text, "file");
  ASSERT_EQ(scenario.faults.size(), 1u);
  EXPECT_EQ(scenario.faults[0].from_ns, 0);
  // Later than any step: no time in a scenario is longer than 1e6 s.
  EXPECT_EQ(scenario.faults[0].to_ns, 1'000'000'000'000'000);
  EXPECT_EQ(scenario.faults[0].vehicle, 0);
}

/// Sync of the minimal scenario with the section `sync: section`.
Sync parse_sync(const std::string& section) {
  return parse_scenario(std::string(kMinimalScenario) + "sync: " + section, "file").sync;
}

TEST(ScenarioTest, PatienceIsTheStartsUnderWaitAndOneSecondUnderOtherPolicies) {
  const Sync silent = parse_sync("{ wait_for: { timeout_s: 7 } }");
  EXPECT_EQ(silent.wait.controller.policy, ControllerPolicy::kWait);
  EXPECT_EQ(silent.wait.controller.deadline_s, 7.0);
  EXPECT_EQ(silent.wait.recorder.policy, RecorderPolicy::kWait);
  EXPECT_EQ(silent.wait.recorder.deadline_s, 7.0);
  EXPECT_EQ(silent.wait.server_deadline_s, 7.0);

  for (const char* policy : {"hold", "failsafe", "stop"}) {
    const Sync sync = parse_sync("{ wait: { controller: { policy: " + std::string(policy) +
                                 " } }, wait_for: { timeout_s: 7 } }");
    EXPECT_EQ(sync.wait.controller.deadline_s, 1.0) << policy;
    EXPECT_EQ(sync.wait.recorder.deadline_s, 7.0) << policy;
    EXPECT_EQ(sync.wait.server_deadline_s, 7.0) << policy;
  }
  for (const char* policy : {"go_on", "stop"})
    EXPECT_EQ(parse_sync("{ wait: { recorder: { policy: " + std::string(policy) + " } } }")
                  .wait.recorder.deadline_s,
              1.0)
        << policy;

  const Sync explicit_wait = parse_sync("{ wait: { controller: { policy: wait } } }");
  EXPECT_EQ(explicit_wait.wait.controller.deadline_s, 30.0);
  const Sync own = parse_sync("{ wait: { controller: { deadline_s: 3 }, server: {} } }");
  EXPECT_EQ(own.wait.controller.policy, ControllerPolicy::kWait);
  EXPECT_EQ(own.wait.controller.deadline_s, 3.0);
  EXPECT_EQ(own.wait.server_deadline_s, 30.0);
}

// docs/reference/scenario.md lists the defaults; its test fails if one changes.
TEST(ScenarioTest, LeavesTheDefaultsWhereTheFileIsSilent) {
  Scenario expected;
  expected.name = "minimal";
  expected.plant.initial.position << 0, 0, -0.5;
  expected.controller.model.follows = {true, true, true};
  expected.mission = {
      {"hold", "hold", ConstantReference{Vector3d(0, 0, -0.5)}, LeaveAfter{2'000'000'000}}};
  EXPECT_EQ(to_yaml(parse_scenario(kMinimalScenario, "file")), to_yaml(expected));
}

TEST(ScenarioTest, ControllerModelEqualsThePlantWhereTheFileSetsNothing) {
  std::string text = replace_once(kMinimalScenario, "plant:", "plant:\n  rotor_drag_n_s_m: 0.3");
  text += "controller: { model: { load_mass_kg: 0.21 } }\n";
  const Scenario scenario = parse_scenario(text, "file");
  EXPECT_EQ(scenario.controller.model.vehicle, (model::SlungLoadParameters{1.5, 0.21, 1.0, 9.8}));
  EXPECT_EQ(scenario.controller.model.air.rotor_drag, 0.3);
}

TEST(ScenarioTest, AnAutopilotInALibraryHasAPeriodAndParameters) {
  const Scenario silent = parse_scenario(make_autopilot_text("{ model: ./mine.so }"), "file");
  EXPECT_EQ(silent.autopilot->model.name, "./mine.so");
  EXPECT_EQ(silent.autopilot->period_ns, 4'000'000);
  EXPECT_EQ(silent.autopilot->own.get<LibraryParameters>().json, "{}");

  const Scenario said = parse_scenario(
      make_autopilot_text("{ model: ./mine.so, period_s: 0.002, parameters: { roll: 6.5 } }"),
      "file");
  EXPECT_EQ(said.autopilot->period_ns, 2'000'000);
  EXPECT_EQ(said.autopilot->own.get<LibraryParameters>().json, R"({"roll": 6.5})");

  EXPECT_TRUE(are_equal(parse_scenario(to_yaml(said), "again"), said));
  EXPECT_EQ(find_error(make_autopilot_text("{ model: none, parameters: {} }")),
            "file:7: autopilot.parameters: a key of shared libraries, here model is 'none'");
  EXPECT_EQ(find_error(make_autopilot_text("{ model: ./mine.so, period_s: 0.0015 }")),
            "file:7: autopilot.period_s: expected a multiple of plant.step_s (0.001), got 0.0015");
}

TEST(ScenarioTest, TheLibraryOfAPlantIsItsOwnOrThatOfItsAutopilot) {
  const auto find = [](const std::string& text) {
    Scenario scenario = parse_scenario(text, "file");
    scenario.folder = "folder";
    return find_plant_library(scenario);
  };
  EXPECT_EQ(find(kMinimalScenario), "");
  EXPECT_EQ(find(replace_once(kMinimalScenario, "plant:", "plant:\n  model: mine.so")),
            "folder/mine.so");
  EXPECT_EQ(find(make_autopilot_text("{ model: none }")), "");
  EXPECT_EQ(find(make_autopilot_text("{ model: mine.so }")), "folder/mine.so");
}

TEST(ScenarioTest, ReadsKeysInAnyOrderAndWithAByteOrderMark) {
  const std::string text = kMinimalScenario, first = "name: minimal\n";
  const std::string reordered = "\xef\xbb\xbf" + text.substr(first.size()) + first;
  EXPECT_TRUE(are_equal(parse_scenario(reordered, "file"), parse_scenario(text, "file")));
}

}  // namespace
}  // namespace sls::config::test
