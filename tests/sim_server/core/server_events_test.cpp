// Every event in every phase of a run: none throws, none is silent by accident.
#include <gtest/gtest.h>

#include "tests/sim_server/core/server_rig.hpp"

namespace sls::sim {
namespace {

struct PhaseCase {
  const char* name;
  Phase phase;
  void (*reach)(ServerRig&);
};

const PhaseCase kPhases[] = {
    {"Claiming", Phase::kClaiming, [](ServerRig&) {}},
    {"Gathering", Phase::kGathering, [](ServerRig& rig) { rig.wait_until(250); }},
    {"Resting", Phase::kResting,
     [](ServerRig& rig) {
       rig.wait_until(250);
       rig.request(ControlAction::ACTION_PAUSE);
       rig.join("pilot");
     }},
    {"AwaitingRecorders", Phase::kAwaitingRecorders,
     [](ServerRig& rig) {
       rig.wait_until(250);
       rig.is_queue_full = true;
       rig.join("pilot");
     }},
    {"AwaitingAnswers", Phase::kAwaitingAnswers,
     [](ServerRig& rig) {
       rig.wait_until(250);
       rig.join("pilot");
     }},
    {"AwaitingDue", Phase::kAwaitingDue,
     [](ServerRig& rig) {
       rig.wait_until(250);
       rig.join("pilot");
       rig.answer("pilot", 0);
     }},
    {"Ended", Phase::kEnded,
     [](ServerRig& rig) {
       rig.wait_until(250);
       rig.request(ControlAction::ACTION_RESET);
     }},
};

struct EventCase {
  const char* name;
  void (*happens)(ServerRig&);
  /// True if the run ends with it, wherever it is.
  bool ends;
};

const EventCase kEvents[] = {
    {"Answer", [](ServerRig& rig) { rig.answer("pilot", rig.step() + 1); }, false},
    {"AnswerOfAStranger", [](ServerRig& rig) { rig.answer("nobody", 0); }, false},
    {"AnswerOfAnotherRun",
     [](ServerRig& rig) {
       ServerRig::Answer answer;
       answer.run_id = 1;
       rig.answer("pilot", answer);
     },
     false},
    {"EmptyAnswer",
     [](ServerRig& rig) {
       ServerRig::Answer answer;
       answer.vehicle_ids.clear();
       rig.answer("pilot", answer);
     },
     false},
    {"Pause", [](ServerRig& rig) { rig.request(ControlAction::ACTION_PAUSE); }, false},
    {"Resume", [](ServerRig& rig) { rig.request(ControlAction::ACTION_RESUME); }, false},
    {"Step", [](ServerRig& rig) { rig.request(ControlAction::ACTION_STEP, 3); }, false},
    {"UnknownAction", [](ServerRig& rig) { rig.request(static_cast<ControlAction>(99)); }, false},
    {"Reset", [](ServerRig& rig) { rig.request(ControlAction::ACTION_RESET); }, true},
    {"Stop", [](ServerRig& rig) { rig.request(ControlAction::ACTION_STOP); }, true},
    {"Signal",
     [](ServerRig& rig) {
       rig.stop("interrupted by SIGTERM");
       rig.wait(20);
     },
     true},
    {"Failure", [](ServerRig& rig) { rig.fail("write refused"); }, true},
    {"Join", [](ServerRig& rig) { rig.join("second", 3); }, false},
    {"Leave", [](ServerRig& rig) { rig.leave("pilot"); }, false},
    {"Recorder", [](ServerRig& rig) { rig.note_recorder("disk", 7); }, false},
    {"Time", [](ServerRig& rig) { rig.wait(3); }, false},
    {"Problem",
     [](ServerRig& rig) {
       rig.problem = "a mistake";
       rig.wait(150);
     },
     false},
};

class ServerEventsTest : public testing::TestWithParam<std::tuple<PhaseCase, EventCase>> {};

TEST_P(ServerEventsTest, IsHandledOrIgnored) {
  const auto& [phase, event] = GetParam();
  auto scenario = phase.phase == Phase::kAwaitingDue ? ServerRig::make_realtime_scenario()
                                                     : ServerRig::make_scenario();
  ServerRig rig(scenario, {ServerRig::kRunId, true, false});
  phase.reach(rig);
  ASSERT_EQ(rig.phase(), phase.phase);
  ASSERT_NO_THROW(event.happens(rig));
  const bool was_ended = phase.phase == Phase::kEnded;
  EXPECT_EQ(rig.phase() == Phase::kEnded, was_ended || event.ends);
  EXPECT_GT(rig.core().next_deadline(), sync::Time());
  if (rig.phase() != Phase::kEnded) return;
  // An ended run stays ended, and its last status says so unless its claim was never settled.
  const std::size_t statuses = rig.statuses().size();
  rig.wait(1000);
  rig.answer("pilot", rig.step());
  EXPECT_EQ(rig.phase(), Phase::kEnded);
  EXPECT_EQ(rig.statuses().size(), statuses);
  if (phase.phase == Phase::kClaiming) {
    EXPECT_EQ(statuses, 0u);
  } else {
    EXPECT_TRUE(rig.status().phase() == RunPhase::PHASE_RESET ||
                rig.status().phase() == RunPhase::PHASE_FAILED);
  }
}

INSTANTIATE_TEST_SUITE_P(AllPhases, ServerEventsTest,
                         testing::Combine(testing::ValuesIn(kPhases), testing::ValuesIn(kEvents)),
                         [](const auto& pair) {
                           return std::string(std::get<0>(pair.param).name) + "_" +
                                  std::get<1>(pair.param).name;
                         });

}  // namespace
}  // namespace sls::sim
