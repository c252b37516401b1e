#include "control_client/flight_controller.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cstring>
#include <limits>
#include <random>

#include "common/model/forces.hpp"
#include "control_client/around_law.hpp"
#include "control_client/laws/qsf/lqr.hpp"
#include "control_client/laws/qsf/qsf_law.hpp"
#include "tests/control_client/sample_scenarios.hpp"
#include "tests/support/errors.hpp"

namespace sls::control {
namespace {

using Eigen::Vector3d;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

model::SlungLoadState make_hanging(const Vector3d& p_WL, double rod_length = 1.0) {
  return model::make_state(p_WL - Vector3d(0.0, 0.0, rod_length), Vector3d::Zero(),
                           model::RodAngles{}, rod_length);
}

model::SlungLoadState draw_state(std::mt19937& generator) {
  std::uniform_real_distribution<double> uniform(-0.5, 0.5);
  const auto draw = [&]() { return uniform(generator); };
  const double x = draw(), y = draw(), z = draw(), vx = draw(), vy = draw(), vz = draw();
  const double a = draw(), b = draw(), a_dot = draw(), b_dot = draw();
  return model::make_state({x, y, z - 1.5}, {vx, vy, vz}, {a, b, a_dot, b_dot}, 1.0);
}

bool same_bits(const Vector3d& a, const Vector3d& b) {
  return std::memcmp(a.data(), b.data(), 3 * sizeof(double)) == 0;
}

bool same_bits(const model::Answer& a, const model::Answer& b) {
  return same_bits(a.f_Q_W, b.f_Q_W) && a.memory.numbers == b.memory.numbers &&
         a.memory.stage == b.memory.stage &&
         a.memory.stage_start_step == b.memory.stage_start_step && a.mission == b.mission &&
         a.error_code == b.error_code && a.stage == b.stage && a.stage_name == b.stage_name &&
         same_bits(a.reference.position, b.reference.position) &&
         same_bits(a.reference.velocity, b.reference.velocity) &&
         same_bits(a.reference.acceleration, b.reference.acceleration) &&
         same_bits(a.reference.jerk, b.reference.jerk) &&
         same_bits(a.reference.snap, b.reference.snap);
}

void expect_failed(const model::Answer& answer, ErrorCode error_code) {
  EXPECT_EQ(answer.error_code, error_code);
  EXPECT_EQ(answer.mission, MissionPhase::kFailed);
  EXPECT_EQ(answer.f_Q_W, Vector3d::Zero());
}

TEST(FlightControllerTest, AnswersWithTheLawsForceReferenceAndStage) {
  const config::Scenario scenario = make_figure_eight();
  const FlightController controller(scenario);
  const model::SlungLoadState state = make_hanging({0.0, 0.0, -0.5});
  const model::Answer answer = controller.calc_answer(0, state, {});
  EXPECT_EQ(answer.mission, MissionPhase::kRunning);
  EXPECT_EQ(answer.error_code, ErrorCode::kNone);
  EXPECT_EQ(answer.stage, 0u);
  EXPECT_EQ(answer.stage_name, "figure_eight");
  EXPECT_EQ(answer.reference.position, Vector3d(0.0, 0.0, -0.5));
  const QsfOutput law =
      calc_qsf({state.p_WQ, state.v_WQ, state.rod, answer.reference, Vector3d::Zero()},
               scenario.vehicle, make_named_gains(LqrWeights{}));
  EXPECT_TRUE(same_bits(answer.f_Q_W, law.f_Q_W));
}

TEST(FlightControllerTest, AForceThatIsNoNumberIsAFaultAndNoImpurity) {
  struct Broken : ControlLaw {
    LawOutput calc(const LawInput&) const override {
      return {{0.0, kNan, 0.0}, {}, ErrorCode::kNone};
    }
  };
  const FlightController controller(make_figure_eight(), 0, true,
                                    [](const LawSetup&) { return std::make_unique<Broken>(); });
  expect_failed(controller.calc_answer(0, make_hanging({0.0, 0.0, -0.5}), {}),
                ErrorCode::kNotFinite);
}

TEST(FlightControllerTest, IsAPureFunctionForSamplesInAnyOrder) {
  config::Scenario scenario = make_figure_eight();
  scenario.mission.insert(scenario.mission.begin(), make_hold({0.0, 0.0, -0.5}, 2 * kSecond));
  NamedGains gains = make_named_gains(LqrWeights{});
  gains.horizontal.integral = gains.vertical.integral = 0.05;
  scenario.controller.own = QsfKeys{gains};
  scenario.controller.drag_feed_forward = true;
  scenario.controller.model.air.rotor_drag = 0.2;
  const FlightController controller(scenario), restarted(scenario);

  struct Sample {
    std::uint64_t step;
    model::SlungLoadState state;
    model::ControllerMemory memory;
  };
  std::mt19937 generator(1);
  std::vector<Sample> samples;
  std::vector<model::Answer> answers;
  model::ControllerMemory memory;
  for (std::uint64_t step = 0; step < 1000; ++step) {
    samples.push_back({step, draw_state(generator), memory});
    answers.push_back(controller.calc_answer(step, samples.back().state, memory));
    ASSERT_EQ(answers.back().error_code, ErrorCode::kNone);
    memory = answers.back().memory;
  }
  EXPECT_EQ(memory.stage, 1u);
  EXPECT_EQ(memory.stage_start_step, 500u);
  std::shuffle(samples.begin(), samples.end(), generator);
  for (const Sample& sample : samples) {
    const model::Answer& first = answers[sample.step];
    ASSERT_TRUE(same_bits(controller.calc_answer(sample.step, sample.state, sample.memory), first));
    ASSERT_TRUE(same_bits(restarted.calc_answer(sample.step, sample.state, sample.memory), first));
  }
}

TEST(FlightControllerTest, FinishesAtDurationOverPeriodWithForceAndReferenceStillComputed) {
  const FlightController controller(make_figure_eight());
  const model::SlungLoadState state = make_hanging({0.0, 0.0, -0.5});
  EXPECT_EQ(controller.calc_answer(7999, state, {}).mission, MissionPhase::kRunning);
  const model::Answer last = controller.calc_answer(8000, state, {});
  EXPECT_EQ(last.mission, MissionPhase::kFinished);
  EXPECT_EQ(last.error_code, ErrorCode::kNone);
  EXPECT_EQ(last.stage, 0u);
  EXPECT_GT(last.f_Q_W.norm(), 1.0);
  EXPECT_GT(last.reference.velocity.norm(), 0.1);
}

TEST(FlightControllerTest, TheMemoryNamesTheStageInForceAtTheStepAnswered) {
  config::Scenario scenario = make_figure_eight();
  scenario.mission.insert(scenario.mission.begin(), make_hold({0.0, 0.0, -0.5}, kSecond));
  const FlightController controller(scenario);
  const model::Answer answer = controller.calc_answer(250, make_hanging({0.0, 0.0, -0.5}), {});
  EXPECT_EQ(answer.stage, 1u);
  EXPECT_EQ(answer.stage_name, "figure_eight");
  EXPECT_EQ(answer.memory.stage, 1u);
  EXPECT_EQ(answer.memory.stage_start_step, 250u);
}

TEST(FlightControllerTest, AdvancesTheIntegralAfterTheForceByForwardEuler) {
  config::Scenario scenario = make_figure_eight(4'000'000);
  scenario.mission = {make_hold({0.0, 0.0, -1.0}, 10 * kSecond)};
  NamedGains gains = make_named_gains(LqrWeights{});
  gains.horizontal.integral = 0.03;
  gains.vertical.integral = 0.02;
  scenario.controller.own = QsfKeys{gains};
  const FlightController controller(scenario);
  const model::SlungLoadState state = make_hanging({0.5, -0.25, -1.125});
  model::ControllerMemory memory;
  memory.numbers = Vector3d(1.0, 2.0, 3.0);
  const model::Answer answer = controller.calc_answer(5, state, memory);
  const Vector3d error(0.5, -0.25, -0.125);
  EXPECT_LE((answer.memory.numbers - memory.numbers - 0.004 * error).norm(), 1e-15);
  // The force depends on the integral before its update.
  const QsfOutput law =
      calc_qsf({state.p_WQ, state.v_WQ, state.rod, answer.reference, memory.numbers},
               scenario.vehicle, gains);
  EXPECT_TRUE(same_bits(answer.f_Q_W, law.f_Q_W));
}

TEST(FlightControllerTest, SaturatesOnlyWhereAsked) {
  config::Scenario scenario = make_figure_eight();
  scenario.mission = {make_hold({10.0, 0.0, -1.0}, 10 * kSecond)};
  scenario.controller.force_limit_n = 17.0;
  const model::SlungLoadState state = make_hanging({0.0, 0.0, -0.5});
  const model::Answer free = FlightController(scenario).calc_answer(0, state, {});
  EXPECT_GT(free.f_Q_W.norm(), 17.0);
  EXPECT_EQ(free.error_code, ErrorCode::kNone);
  scenario.controller.saturate = true;
  const model::Answer limited = FlightController(scenario).calc_answer(0, state, {});
  EXPECT_LE(limited.f_Q_W.norm(), 17.0);
  EXPECT_NEAR(limited.f_Q_W.norm(), 17.0, 1e-10);
  EXPECT_LE(limited.f_Q_W.normalized().cross(free.f_Q_W.normalized()).norm(), 1e-15);
}

TEST(FlightControllerTest, FeedsForwardTheDragOfItsModel) {
  config::Scenario scenario = make_figure_eight();
  std::mt19937 generator(2);
  const model::SlungLoadState state = draw_state(generator);
  const Vector3d plain = FlightController(scenario).calc_answer(0, state, {}).f_Q_W;
  scenario.plant.air.rotor_drag = 9.0;  // the controller must not use the true value
  scenario.controller.model.air.rotor_drag = 0.3;
  EXPECT_EQ(FlightController(scenario).calc_answer(0, state, {}).f_Q_W, plain);
  scenario.controller.drag_feed_forward = true;
  const Vector3d force = FlightController(scenario).calc_answer(0, state, {}).f_Q_W;
  const Vector3d drag = model::calc_rotor_drag(force, state.v_WQ, scenario.controller.model.air);
  EXPECT_GT(drag.norm(), 0.01);
  EXPECT_LE((force + drag - plain).norm(), 2e-12 * plain.norm());
}

TEST(FlightControllerTest, GazeboWiringUsesThePlantsRodAndTheLawItsModels) {
  config::Scenario scenario = make_figure_eight();
  scenario.vehicle.rod_length = 1.1;
  scenario.controller.state_wiring = config::StateWiring::kGazeboPlugin;
  std::mt19937 generator(3);
  const model::SlungLoadState state = draw_state(generator);
  const model::Answer answer = FlightController(scenario).calc_answer(0, state, {});
  const model::RodAngles slots =
      calc_wired_angles(state.rod, config::StateWiring::kGazeboPlugin, 1.1);
  const QsfOutput law =
      calc_qsf({state.p_WQ, state.v_WQ, slots, answer.reference, Vector3d::Zero()},
               scenario.controller.model.vehicle, make_named_gains(LqrWeights{}));
  EXPECT_EQ(scenario.controller.model.vehicle.rod_length, 1.0);
  EXPECT_TRUE(same_bits(answer.f_Q_W, law.f_Q_W));
}

TEST(FlightControllerTest, AFaultFailsTheMissionWithoutAForce) {
  config::Scenario scenario = make_figure_eight();
  const FlightController controller(scenario);
  model::SlungLoadState level =
      model::make_state({0, 0, -1.5}, {0, 0, 0}, model::RodAngles{1.5707, 0.0, 0.0, 0.0}, 1.0);
  expect_failed(controller.calc_answer(0, level, {}), ErrorCode::kRodLevel);
  expect_failed(controller.calc_answer(0, make_hanging({0.0, 0.0, -9.0}), {}),
                ErrorCode::kFreeFall);
  // Also at the step at which the mission would finish.
  expect_failed(controller.calc_answer(8000, level, {}), ErrorCode::kRodLevel);
}

TEST(FlightControllerTest, EveryNumberOfASampleThatIsNotFiniteIsAFault) {
  const FlightController controller(make_figure_eight());
  const model::SlungLoadState good = make_hanging({0.0, 0.0, -0.5});
  for (Vector3d model::SlungLoadState::*vector :
       {&model::SlungLoadState::p_WQ, &model::SlungLoadState::v_WQ, &model::SlungLoadState::p_WL,
        &model::SlungLoadState::v_WL}) {
    model::SlungLoadState bad = good;
    (bad.*vector).y() = kNan;
    expect_failed(controller.calc_answer(0, bad, {}), ErrorCode::kNotFinite);
  }
  model::SlungLoadState bad = good;
  bad.rod.beta_dot = std::numeric_limits<double>::infinity();
  expect_failed(controller.calc_answer(0, bad, {}), ErrorCode::kNotFinite);
  model::ControllerMemory memory;
  memory.numbers = Vector3d(0.0, 0.0, kNan);
  expect_failed(controller.calc_answer(0, good, memory), ErrorCode::kNotFinite);
}

TEST(FlightControllerTest, AMemoryThatCannotBeIsAFaultNotACrash) {
  const FlightController controller(make_figure_eight());
  const model::SlungLoadState state = make_hanging({0.0, 0.0, -0.5});
  model::ControllerMemory memory;
  for (const std::uint32_t stage : {2u, 0xffffffffu}) {  // 1 is valid: the only stage is over
    memory.stage = stage;
    expect_failed(controller.calc_answer(100, state, memory), ErrorCode::kNotFinite);
  }
  memory.stage = 0;
  memory.stage_start_step = 101;
  expect_failed(controller.calc_answer(100, state, memory), ErrorCode::kNotFinite);
  memory.stage_start_step = std::numeric_limits<std::uint64_t>::max();
  expect_failed(controller.calc_answer(100, state, memory), ErrorCode::kNotFinite);
}

TEST(FlightControllerTest, AStageThatTimesOutFailsTheMission) {
  config::Scenario scenario = make_figure_eight();
  config::Stage stage = make_hold({0.0, 0.0, -0.5}, 0);
  config::LeaveUntil leave;
  leave.after_ns = kSecond;
  leave.timeout_ns = 2 * kSecond;
  stage.leave = leave;
  scenario.mission = {stage};
  const FlightController controller(scenario);
  const model::SlungLoadState far = make_hanging({0.5, 0.0, -0.5});
  EXPECT_EQ(controller.calc_answer(499, far, {}).mission, MissionPhase::kRunning);
  const model::Answer answer = controller.calc_answer(500, far, {});
  expect_failed(answer, ErrorCode::kStageTimeout);
  EXPECT_EQ(answer.reference.position, Vector3d(0.0, 0.0, -0.5));
}

TEST(FlightControllerTest, RadiusStagesUseTheTrueLoadNotTheModels) {
  config::Scenario scenario = make_figure_eight();
  scenario.vehicle.rod_length = 1.5;  // the controller's model has 1.0
  config::Stage stage = make_hold({0.0, 0.0, -1.0}, 0);
  config::LeaveUntil leave;
  leave.radius_m = 0.1;
  leave.timeout_ns = 100 * kSecond;
  stage.leave = leave;
  scenario.mission = {stage};
  const FlightController controller(scenario);
  EXPECT_EQ(controller.calc_answer(1, make_hanging({0.0, 0.0, -1.0}, 1.5), {}).mission,
            MissionPhase::kFinished);
  EXPECT_EQ(controller.calc_answer(1, make_hanging({0.0, 0.0, -0.5}, 1.5), {}).mission,
            MissionPhase::kRunning);
}

TEST(FlightControllerTest, RefusesALawItDoesNotKnowAndWeightsWithoutSolution) {
  config::Scenario scenario = make_figure_eight();
  scenario.controller.law.name = "lqr";
  EXPECT_EQ(test::find_error<config::ConfigError>([&] { FlightController{scenario}; }),
            "controller.law: expected cooperative, pid, qsf or a shared library (a path ending in "
            ".so), got lqr");
  scenario.controller.law.name = "qsf";
  scenario.controller.own = QsfKeys{LqrWeights{-1.0, 5.0}};
  EXPECT_THROW(FlightController{scenario}, config::ConfigError);
  scenario.controller.own = QsfKeys{LqrWeights{}};
  scenario.mission.clear();
  EXPECT_THROW(FlightController{scenario}, config::ConfigError);
}

TEST(FlightControllerTest, FaultsHaveTheNamesOfTheDesign) {
  EXPECT_STREQ(to_string(ErrorCode::kNone), "none");
  EXPECT_STREQ(to_string(ErrorCode::kFreeFall), "free_fall");
  EXPECT_STREQ(to_string(ErrorCode::kRodLevel), "rod_level");
  EXPECT_STREQ(to_string(ErrorCode::kNotFinite), "not_finite");
  EXPECT_STREQ(to_string(ErrorCode::kStageTimeout), "stage_timeout");
}

}  // namespace
}  // namespace sls::control
