// The earliest end of a mission against the missions that the client flies.
#include "sim_server/core/answers/judgement.hpp"

#include <gtest/gtest.h>

#include <random>

#include "control_client/mission.hpp"

namespace sls::sim {
namespace {

config::Scenario make_scenario(std::int64_t period_ns,
                               const std::vector<config::LeaveCondition>& leaves) {
  config::Scenario scenario;
  scenario.sync.period_ns = period_ns;
  for (const config::LeaveCondition& leave : leaves) {
    config::Stage stage;
    stage.reference = config::ConstantReference();
    stage.leave = leave;
    scenario.mission.push_back(stage);
  }
  return scenario;
}

std::uint64_t calc_earliest_end(std::int64_t period_ns,
                                const std::vector<config::LeaveCondition>& leaves) {
  return make_answer_limits(make_scenario(period_ns, leaves)).earliest_end;
}

config::LeaveUntil make_within(std::int64_t after_ns) {
  config::LeaveUntil leave;
  leave.after_ns = after_ns;
  leave.radius_m = 1e3;
  leave.timeout_ns = after_ns + 1'000'000'000;
  return leave;
}

TEST(JudgementTest, AMissionCannotBeOverBeforeTheLeastDurationsOfItsStages) {
  EXPECT_EQ(calc_earliest_end(10, {config::LeaveAfter{200}}), 20u);
  EXPECT_EQ(calc_earliest_end(10, {config::LeaveAfter{200}, config::LeaveAfter{0}}), 20u);
  EXPECT_EQ(calc_earliest_end(10, {config::LeaveAfter{200}, make_within(50)}), 25u);
  EXPECT_EQ(calc_earliest_end(10, {make_within(0), make_within(0)}), 0u);
  EXPECT_EQ(calc_earliest_end(10, {make_within(51), config::LeaveAfter{9}}), 7u)
      << "a stage ends at a step";
}

/// The first step at which the client says that the mission is over.
std::uint64_t fly(const config::Scenario& scenario, const AnswerLimits& limits) {
  const control::Mission mission(scenario.mission, scenario.sync.period_ns);
  model::ControllerMemory memory;
  for (std::uint64_t step = 0;; ++step) {
    const control::MissionProgress progress = mission.calc_progress(step, {}, memory);
    memory.stage = progress.remembered_stage;
    memory.stage_start_step = progress.stage_start_step;
    model::Answer answer;
    answer.mission = progress.phase;
    answer.memory = memory;
    if (const auto defect = find_defect(step, answer, limits))
      ADD_FAILURE() << describe_refusal(*defect, step, answer, limits, "ours");
    if (answer.mission == model::MissionPhase::kFinished) return step;
  }
}

TEST(JudgementTest, NoMissionThatTheClientFliesIsRefused) {
  std::mt19937_64 random(27);
  for (int i = 0; i < 2'000; ++i) {
    const auto period_ns = static_cast<std::int64_t>(1 + random() % 9);
    std::vector<config::LeaveCondition> leaves;
    std::uint64_t waits = 0;  // a stage with a radius ends one step late at the most here
    for (std::uint64_t count = 1 + random() % 4; count > 0; --count) {
      const auto least = static_cast<std::int64_t>(random() % 40);
      if (random() % 2 == 0) {
        leaves.emplace_back(config::LeaveAfter{least});
      } else {
        leaves.emplace_back(make_within(least));
        ++waits;
      }
    }
    const config::Scenario scenario = make_scenario(period_ns, leaves);
    const AnswerLimits limits = make_answer_limits(scenario);
    const std::uint64_t end = fly(scenario, limits);
    EXPECT_LE(end, limits.earliest_end + waits);
    if (waits == 0) {
      EXPECT_EQ(end, limits.earliest_end);
    }
  }
}

}  // namespace
}  // namespace sls::sim
