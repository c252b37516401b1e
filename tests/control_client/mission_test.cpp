#include "control_client/mission.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "control_client/laws/control_law.hpp"
#include "tests/control_client/sample_scenarios.hpp"

namespace sls::control {
namespace {

using Eigen::Vector3d;

constexpr std::int64_t kPeriod = 4'000'000;
constexpr std::uint64_t kNever = std::numeric_limits<std::uint64_t>::max();

model::SlungLoadState make_state_at(const Vector3d& p_WQ, const Vector3d& p_WL) {
  model::SlungLoadState state;
  state.p_WQ = p_WQ;
  state.p_WL = p_WL;
  return state;
}

config::Stage make_within(const config::LeaveUntil& leave, const Vector3d& position) {
  config::Stage stage;
  stage.kind = stage.name = "set_point";
  stage.reference = config::ConstantReference{position};
  stage.leave = leave;
  return stage;
}

/// Steps the mission with `state_at(step)`. @returns the first step at which it is not running.
template <typename StateAt>
std::uint64_t run(const Mission& mission, const StateAt& state_at, std::uint64_t limit,
                  MissionProgress& last, std::vector<std::uint64_t>* starts = nullptr) {
  model::ControllerMemory memory;
  for (std::uint64_t step = 0; step < limit; ++step) {
    last = mission.calc_progress(step, state_at(step), memory);
    if (starts != nullptr && (step == 0 || last.stage != memory.stage)) {
      starts->push_back(last.stage_start_step);
    }
    if (last.phase != MissionPhase::kRunning) return step;
    memory.stage = last.stage;
    memory.stage_start_step = last.stage_start_step;
  }
  return kNever;
}

const auto kAnywhere = [](std::uint64_t) { return model::SlungLoadState{}; };

TEST(MissionTest, OneTimedStageFinishesAtItsDurationOverThePeriod) {
  for (const std::int64_t period : {1'000'000, 2'000'000, 4'000'000, 8'000'000, 20'000'000}) {
    const Mission mission({make_hold({0, 0, -1}, 32 * kSecond)}, period);
    MissionProgress last;
    EXPECT_EQ(run(mission, kAnywhere, 40'000, last), 32u * kSecond / period);
    EXPECT_EQ(last.phase, MissionPhase::kFinished);
    EXPECT_EQ(last.stage, 0u);
    EXPECT_EQ(last.stage_start_step, 0u);
  }
}

TEST(MissionTest, APeriodThatIsNoFiniteDecimalInSecondsCountsExactly) {
  // Nine periods are 3 ns shorter than the stage: the mission counts whole nanoseconds.
  const Mission mission({make_hold({0, 0, -1}, 3'000'000'000)}, 333'333'333);
  MissionProgress last;
  EXPECT_EQ(run(mission, kAnywhere, 100, last), 10u);  // nine periods: 2,999,999,997 ns
}

TEST(MissionTest, StageTimeCountsFromTheStagesStart) {
  const Mission mission({make_hold({0, 0, -1}, 1 * kSecond), make_figure_eight_stage(-0.5)},
                        kPeriod);
  const FigureEight eight(
      std::get<config::FigureEightReference>(make_figure_eight_stage(-0.5).reference));
  model::ControllerMemory memory;
  memory.stage = 1;
  memory.stage_start_step = 250;
  const MissionProgress progress = mission.calc_progress(250 + 1000, {}, memory);
  EXPECT_EQ(progress.reference.position, eight.calc(4.0).position);
  EXPECT_EQ(progress.reference.snap, eight.calc(4.0).snap);
  // At the step of the switch the new stage is active, at its time 0.
  const MissionProgress first = mission.calc_progress(250, {}, {});
  EXPECT_EQ(first.stage, 1u);
  EXPECT_EQ(first.reference.velocity, eight.calc(0.0).velocity);
}

TEST(MissionTest, ARadiusStageIsLeftStrictlyAfterAndStrictlyWithin) {
  config::LeaveUntil leave;
  leave.after_ns = 1 * kSecond;
  leave.radius_m = 0.25;  // exact in binary
  leave.timeout_ns = 10 * kSecond;
  const Mission mission({make_within(leave, {1, 0, -2})}, kPeriod);
  const auto inside = make_state_at({0, 0, 0}, {1, 0, -2});
  const auto on_the_sphere = make_state_at({0, 0, 0}, {1.25, 0, -2});
  EXPECT_EQ(mission.calc_progress(249, inside, {}).phase, MissionPhase::kRunning);
  EXPECT_EQ(mission.calc_progress(250, inside, {}).phase, MissionPhase::kRunning);
  EXPECT_EQ(mission.calc_progress(251, inside, {}).phase, MissionPhase::kFinished);
  EXPECT_EQ(mission.calc_progress(251, on_the_sphere, {}).phase, MissionPhase::kRunning);
}

TEST(MissionTest, AStageEndsByCableLoadAndTension) {
  using Condition = config::LeaveUntil::Condition;
  struct Case {
    Condition condition;
    config::CableState cable;
    config::LoadPlace load;
    std::vector<double> ends, stays;  // tension, taut, load on the ground
  };
  using config::CableState, config::LoadPlace;
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const Case cases[] = {
      {Condition::kCable, CableState::kTaut, {}, {0, 1, 0}, {9, 0, 1}},
      {Condition::kCable, CableState::kSlack, {}, {9, 0, 1}, {0, 1, 0}},
      {Condition::kLoad, {}, LoadPlace::kOnGround, {9, 0, 1}, {0, 1, 0}},
      {Condition::kLoad, {}, LoadPlace::kOffGround, {0, 1, 0}, {9, 0, 1}},
      {Condition::kTensionAbove, {}, {}, {1.5000001, 0, 1}, {1.5, 1, 0}},
      {Condition::kTensionBelow, {}, {}, {1.4999999, 0, 1}, {1.5, 1, 0}},
  };
  constexpr Eigen::Index kOnGround = 11;
  const auto see = [&](const std::vector<double>& seen) {
    model::Measurement state;
    state.signals.setZero(kOnGround + 1);
    state.signals[model::SharedLoad::kTension] = seen[0];
    state.signals[model::SharedLoad::kTaut] = seen[1];
    state.signals[kOnGround] = seen[2];
    return state;
  };
  for (const Case& a : cases) {
    config::LeaveUntil leave;
    leave.condition = a.condition;
    leave.cable = a.cable;
    leave.load = a.load;
    leave.tension_n = 1.5;
    leave.after_ns = 1 * kSecond;
    leave.timeout_ns = 2 * kSecond;
    const Mission mission({make_within(leave, {1, 0, -2})}, kPeriod,
                          CableEnd{Eigen::Quaterniond::Identity(), {0, 0, 0}, kOnGround});
    const auto phase = [&](std::uint64_t step, const model::Measurement& state) {
      return mission.calc_progress(step, state, {}).phase;
    };
    EXPECT_EQ(phase(250, see(a.ends)), MissionPhase::kRunning);
    EXPECT_EQ(phase(251, see(a.ends)), MissionPhase::kFinished);
    EXPECT_EQ(phase(499, see(a.stays)), MissionPhase::kRunning);
    EXPECT_EQ(phase(500, see(a.stays)), MissionPhase::kFailed);
    EXPECT_EQ(phase(251, {}), MissionPhase::kRunning) << "a sample without signals";
    EXPECT_EQ(phase(251, see({nan, nan, nan})), MissionPhase::kRunning);
  }
}

TEST(MissionTest, AFinishedMissionStaysFinishedWhereverTheBodyGoes) {
  config::LeaveUntil leave;
  leave.radius_m = 0.25;
  leave.timeout_ns = 10 * kSecond;
  const Mission mission({make_hold({0, 0, -1}, 1 * kSecond), make_within(leave, {1, 0, -2})},
                        kPeriod);
  const auto inside = make_state_at({0, 0, 0}, {1, 0, -2});
  const auto outside = make_state_at({0, 0, 0}, {9, 0, -2});
  model::ControllerMemory memory;
  const auto remember = [&](const MissionProgress& progress) {
    memory.stage = progress.remembered_stage;
    memory.stage_start_step = progress.stage_start_step;
    return progress;
  };
  EXPECT_EQ(remember(mission.calc_progress(250, outside, memory)).phase, MissionPhase::kRunning);
  EXPECT_EQ(remember(mission.calc_progress(300, inside, memory)).phase, MissionPhase::kFinished);
  for (const std::uint64_t step : {301, 5000}) {  // before and after the stage's time limit
    const MissionProgress progress = remember(mission.calc_progress(step, outside, memory));
    EXPECT_EQ(progress.phase, MissionPhase::kFinished);
    EXPECT_EQ(progress.stage, 1u);
    EXPECT_EQ(progress.stage_start_step, 250u);
    EXPECT_EQ(progress.reference.position, Vector3d(1, 0, -2));
  }
}

TEST(MissionTest, ARadiusMayBeAroundTheQuadrotorWithAnOffset) {
  config::LeaveUntil leave;
  leave.after_ns = 15 * kSecond;
  leave.radius_m = 0.2;
  leave.body = config::Body::kQuadrotor;
  leave.offset << 0.0, 0.0, -0.95;
  leave.timeout_ns = 60 * kSecond;
  const Mission mission({make_within(leave, {1, -1, -2})}, kPeriod);
  const std::uint64_t later = 3751;  // first step after 15 s
  // √((x−x_d)² + (y−y_d)² + (z−z_d+0.95)²) < 0.2, for any position of the load.
  EXPECT_EQ(mission.calc_progress(later, make_state_at({1.1, -1.1, -2.85}, {9, 9, 9}), {}).phase,
            MissionPhase::kFinished);
  EXPECT_EQ(mission.calc_progress(later, make_state_at({1.1, -1.1, -3.15}, {1, -1, -2}), {}).phase,
            MissionPhase::kRunning);
  EXPECT_EQ(mission.calc_progress(later, make_state_at({1, -1, -2}, {1, -1, -2}), {}).phase,
            MissionPhase::kRunning);
}

TEST(MissionTest, TheRadiusFollowsAMovingReference) {
  config::Stage stage = make_figure_eight_stage(-0.5);
  config::LeaveUntil leave;
  leave.timeout_ns = 100 * kSecond;
  stage.leave = leave;
  const Mission mission({stage}, kPeriod);
  const FigureEight eight(std::get<config::FigureEightReference>(stage.reference));
  const Vector3d there = eight.calc(4.0).position;
  EXPECT_EQ(mission.calc_progress(1000, make_state_at({0, 0, 0}, there), {}).phase,
            MissionPhase::kFinished);
  EXPECT_EQ(mission.calc_progress(500, make_state_at({0, 0, 0}, there), {}).phase,
            MissionPhase::kRunning);
}

TEST(MissionTest, AStageWhoseRadiusIsNotReachedInTimeFails) {
  config::LeaveUntil leave;
  leave.after_ns = 1 * kSecond;
  leave.timeout_ns = 2 * kSecond;
  const Mission mission({make_within(leave, {1, 0, -2}), make_hold({0, 0, 0}, kSecond)}, kPeriod);
  const auto far = make_state_at({0, 0, 0}, {5, 0, -2});
  MissionProgress last;
  EXPECT_EQ(run(
                mission, [&](std::uint64_t) { return far; }, 10'000, last),
            500u);
  EXPECT_EQ(last.phase, MissionPhase::kFailed);
  EXPECT_EQ(last.stage, 0u);
  // An arrival at the step of the timeout counts.
  EXPECT_EQ(mission.calc_progress(500, make_state_at({0, 0, 0}, {1, 0, -2}), {}).stage, 1u);
}

TEST(MissionTest, MixedStagesSwitchAtTheStepTheyShould) {
  // hold 1 s, then a point that the load reaches at step 700, then hold 1 s.
  config::LeaveUntil leave;
  leave.after_ns = 1 * kSecond;
  leave.timeout_ns = 60 * kSecond;
  const Mission mission({make_hold({0, 0, -1}, 1 * kSecond), make_within(leave, {1, 0, -2}),
                         make_hold({0, 0, -1}, 1 * kSecond)},
                        kPeriod);
  const auto state_at = [](std::uint64_t step) {
    return make_state_at({0, 0, 0}, {1, 0, step < 700 ? 0.0 : -2.0});
  };
  MissionProgress last;
  std::vector<std::uint64_t> starts;
  EXPECT_EQ(run(mission, state_at, 10'000, last, &starts), 950u);
  EXPECT_EQ(starts, (std::vector<std::uint64_t>{0, 250, 700}));
  EXPECT_EQ(last.stage, 2u);
  EXPECT_EQ(last.reference.position, Vector3d(0, 0, -1));
}

TEST(MissionTest, StagesOfNoDurationArePassedAtOnce) {
  const Mission mission(
      {make_hold({0, 0, -1}, 0), make_hold({1, 0, -1}, 0), make_hold({2, 0, -1}, kSecond)},
      kPeriod);
  const MissionProgress progress = mission.calc_progress(0, {}, {});
  EXPECT_EQ(progress.stage, 2u);
  EXPECT_EQ(progress.stage_start_step, 0u);
}

TEST(MissionTest, RejectsAnImpossibleMemory) {
  const Mission mission({make_hold({0, 0, -1}, kSecond)}, kPeriod);
  model::ControllerMemory memory;
  EXPECT_TRUE(mission.is_possible(0, memory));
  memory.stage_start_step = 10;
  EXPECT_FALSE(mission.is_possible(9, memory));
  EXPECT_TRUE(mission.is_possible(10, memory));
  memory.stage = 1;  // the mission is over
  EXPECT_TRUE(mission.is_possible(10, memory));
  memory.stage = 2;
  EXPECT_FALSE(mission.is_possible(10, memory));
}

TEST(MissionTest, TimeBeyondTheClocksRangeEndsTheStageInsteadOfOverflowing) {
  const Mission mission({make_hold({0, 0, -1}, kSecond), make_figure_eight_stage(-0.5)}, kPeriod);
  const MissionProgress progress = mission.calc_progress(kNever, {}, {});
  EXPECT_EQ(progress.stage, 1u);
  model::ControllerMemory memory;
  memory.stage = 1;
  EXPECT_EQ(mission.calc_progress(kNever, {}, memory).phase, MissionPhase::kFinished);
}

TEST(MissionTest, NeedsAStageAndAPeriod) {
  EXPECT_THROW(Mission({}, kPeriod), config::ConfigError);
  EXPECT_THROW(Mission({make_hold({0, 0, 0}, kSecond)}, 0), config::ConfigError);
}

TEST(MissionTest, AStageThatTurnsASharedLoadMovesTheEndOfTheCableAboutItsCentre) {
  const Vector3d attachment(0.3, 0.1, -0.05), centre(1.0, 2.0, -3.0);
  config::Stage level = make_hold(centre + attachment, kSecond), turned = level;
  auto& hold = std::get<config::ConstantReference>(turned.reference);
  hold.attitude = Vector3d(0.0, 0.0, 1.5);
  const Mission mission({level, turned}, kPeriod,
                        CableEnd{Eigen::Quaterniond::Identity(), attachment});
  const MissionProgress first = mission.calc_progress(0, {}, {});
  EXPECT_EQ(first.reference.position, Vector3d(centre + attachment));  // to the last bit
  EXPECT_LE((first.load_reference.position - centre).norm(), 1e-15);
  EXPECT_EQ(first.load_attitude.R_WL, Eigen::Matrix3d::Identity());
  model::ControllerMemory memory;
  memory.stage = 1;
  const MissionProgress second = mission.calc_progress(0, {}, memory);
  const double c = std::cos(1.5), s = std::sin(1.5);
  EXPECT_LE((second.load_reference.position - centre).norm(), 1e-15);
  EXPECT_LE(
      (second.reference.position - centre - Vector3d(0.3 * c - 0.1 * s, 0.3 * s + 0.1 * c, -0.05))
          .norm(),
      1e-15);
  // Without a shared load the references are the stage's own.
  const MissionProgress alone = Mission({level}, kPeriod).calc_progress(0, {}, {});
  EXPECT_EQ(alone.load_reference.position, alone.reference.position);
}

}  // namespace
}  // namespace sls::control
