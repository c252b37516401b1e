// A run in lockstep: docs/synchronisation.md, from "Lockstep" to "Operator control".
#include <gtest/gtest.h>

#include "sim_server/plants/multirotor/keys.hpp"
#include "tests/sim_server/core/server_rig.hpp"

namespace sls::sim {
namespace {

using End = ServerCore::End;

config::Scenario with_policy(config::ControllerPolicy policy, double deadline_s) {
  auto scenario = ServerRig::make_scenario();
  scenario.sync.wait.controller = {policy, deadline_s};
  return scenario;
}

config::Scenario with_two_vehicles(config::Scenario scenario) {
  scenario.vehicles.resize(2, scenario.vehicles.front());
  return scenario;
}

ServerRig::Answer for_vehicles(const std::vector<std::uint32_t>& vehicle_ids,
                               std::uint64_t step = 0) {
  ServerRig::Answer answer{step};
  answer.vehicle_ids = vehicle_ids;
  return answer;
}

TEST(ServerLockstepTest, EachAnswerBringsTheNextStateAtOnce) {
  ServerRig rig;
  rig.join("pilot");
  rig.answer("pilot", 0);
  rig.wait_until(3);
  rig.answer("pilot", 1);
  EXPECT_EQ(rig.take_states(), (Lines{"0: state 0", "0: state 1", "3: state 2"}));
  EXPECT_EQ(rig.take_records(), (Lines{"0 accepted", "1 accepted"}));
}

TEST(ServerLockstepTest, AStepOfAFleetNeedsTheAnswerForEachVehicle) {
  ServerRig rig(with_two_vehicles(ServerRig::make_scenario()));
  rig.join("pilot");
  rig.answer("pilot", for_vehicles({0}));
  rig.wait_until(20);
  EXPECT_EQ(rig.take_states(), (Lines{"0: state 0", "20: state 0 again 1"}))
      << "only what lacks an answer is sent again";
  rig.answer("pilot", for_vehicles({1}));
  EXPECT_EQ(rig.take_states(), Lines{"20: state 1"});
}

TEST(ServerLockstepTest, WithoutAnAnswerTheStateIsSentAgainInDoublingIntervals) {
  ServerRig rig;
  rig.join("pilot");
  rig.wait_until(19);
  EXPECT_EQ(rig.take_states(), Lines{"0: state 0"});
  rig.wait_until(300);
  EXPECT_EQ(rig.take_states(), (Lines{"20: state 0 again", "60: state 0 again",
                                      "140: state 0 again", "240: state 0 again"}));
  rig.wait_until(420);
  EXPECT_EQ(rig.status().counters().resent(), 5u);
}

TEST(ServerLockstepTest, ResendTimeoutIsFourRoundTrips) {
  ServerRig rig;
  rig.join("pilot");
  rig.wait_until(2);
  rig.answer("pilot", 0);
  rig.take_states();
  rig.wait_until(9);
  EXPECT_EQ(rig.take_states(), Lines{});
  rig.wait_until(10);
  EXPECT_EQ(rig.take_states(), Lines{"10: state 1 again"});
}

TEST(ServerLockstepTest, AnAnswerBeforeItsStateIsRefusedAndACopyChangesNothing) {
  ServerRig rig;
  rig.answer("pilot", 0);
  rig.join("pilot");
  EXPECT_EQ(rig.take_states(), Lines{"0: state 0"});
  rig.answer("pilot", 1);
  EXPECT_EQ(rig.step(), 0u);
  rig.answer("pilot", 0);
  rig.answer("pilot", 0);
  EXPECT_EQ(rig.step(), 1u);
  rig.wait_until(400);
  EXPECT_EQ(rig.status().counters().duplicate(), 1u);
  EXPECT_EQ(rig.status().counters().rejected_step(), 2u);
}

TEST(ServerLockstepTest, AnswersThatMoveNoVehicleAreCounted) {
  ServerRig rig;
  rig.join("pilot", 1);
  rig.join("standby");
  rig.answer("pilot", 0);
  rig.answer("standby", 0);
  rig.answer("pilot", for_vehicles({7}, 1));
  ServerRig::Answer empty = for_vehicles({});
  empty.run_id = 1;  // may be right there
  rig.answer("pilot", empty);
  rig.wait_until(400);
  EXPECT_EQ(rig.step(), 1u);
  EXPECT_EQ(rig.status().counters().superseded(), 1u);
  EXPECT_EQ(rig.status().counters().rejected_vehicle(), 1u);
  EXPECT_EQ(rig.status().counters().rejected_run(), 0u);
}

TEST(ServerLockstepTest, AnAnswerOfNoVehicleIsASignOfLife) {
  for (const bool answers : {true, false}) {
    ServerRig rig;
    rig.repeats_announcements = false;
    rig.join("pilot");
    rig.fall_silent("pilot");
    for (int ms = 100; ms <= 6500; ms += 100) {
      if (answers) rig.answer("pilot", for_vehicles({}));
      rig.wait_until(ms);
    }
    rig.stop("interrupted by SIGINT");
    EXPECT_EQ(rig.core().error(), "");
    const Lines log = rig.take_log();
    const bool is_gone = log.back().find("(gone)") != std::string::npos;
    EXPECT_EQ(is_gone, !answers) << log.back();
  }
}

TEST(ServerLockstepTest, TheAnswerThatEndsTheMissionEndsTheRun) {
  ServerRig rig;
  rig.join("pilot");
  rig.fly_to(100);
  rig.request(ControlAction::ACTION_PAUSE);
  rig.answer("pilot", 101);
  rig.wait(500'000);
  rig.request(ControlAction::ACTION_RESUME);
  rig.fly_to(249);
  rig.take_records();
  ServerRig::Answer last{250};
  last.is_last = true;
  rig.answer("pilot", last);
  EXPECT_EQ(rig.core().end(), End::kFinished);
  EXPECT_EQ(rig.take_records(), (Lines{"250 accepted", "end"}));
  EXPECT_EQ(rig.status().phase(), RunPhase::PHASE_FINISHED);
  EXPECT_EQ(rig.status().step(), 250u);
  EXPECT_EQ(rig.status().timing().to_string(), "exact");
  EXPECT_NE(rig.take_log().back().find("finished: 250 steps, 1 s simulated in 0.00 s"),
            std::string::npos)
      << "a pause is no flying time";
  rig.fail("sls/status: write refused");
  EXPECT_EQ(rig.core().end(), End::kFinished) << "a finished run stays so";
  EXPECT_EQ(rig.status().phase(), RunPhase::PHASE_FINISHED);
  EXPECT_EQ(rig.core().error(), "sls/status: write refused");
}

TEST(ServerLockstepTest, ARefusedAnswerOfTheOnlyClientFailsTheRun) {
  ServerRig rig;
  rig.join("pilot");
  ServerRig::Answer broken{0};
  broken.error_code = model::ErrorCode::kFreeFall;
  rig.answer("pilot", broken);
  EXPECT_EQ(rig.core().error(), "controller 'pilot' answered step 0 with a fault: free_fall");
  EXPECT_EQ(rig.take_records(), (Lines{"0 refused", "end"}));
  EXPECT_EQ(rig.status().phase(), RunPhase::PHASE_FAILED);
}

TEST(ServerLockstepTest, ARefusedAnswerBesideASilentClientFailsItAfterTwoSeconds) {
  ServerRig rig;
  rig.join("pilot");
  rig.join("standby", -1);
  ServerRig::Answer broken{0};
  broken.error_code = model::ErrorCode::kFreeFall;
  rig.answer("pilot", broken);
  rig.fall_silent("standby");
  rig.wait_until(1999);
  EXPECT_EQ(rig.phase(), Phase::kAwaitingAnswers);
  rig.wait_until(2020);
  EXPECT_EQ(rig.core().end(), End::kFailed);
  EXPECT_EQ(rig.core().error().rfind("controller 'pilot' answered step 0 with a fault", 0), 0u);
}

TEST(ServerLockstepTest, AFailedPlantFailsTheRunAndRecordsTheStepOnce) {
  ServerRig rig;
  rig.join("pilot");
  rig.answer("pilot", 0);
  rig.fail("quad_x_m is not finite");
  EXPECT_EQ(rig.core().error(), "quad_x_m is not finite");
  EXPECT_EQ(rig.take_records(), (Lines{"0 accepted", "1 none", "end"}));
  rig.fail("again");
  EXPECT_EQ(rig.core().error(), "quad_x_m is not finite") << "only the first failure counts";
}

TEST(ServerLockstepTest, TheLastRecordHasTheAnswersThatCameBeforeTheEnd) {
  ServerRig rig(with_two_vehicles(ServerRig::make_scenario()));
  rig.join("pilot");
  rig.answer("pilot", for_vehicles({0}));
  rig.request(ControlAction::ACTION_STOP);
  EXPECT_EQ(rig.take_records(), (Lines{"0 accepted", "0 none", "end"}));
}

TEST(ServerLockstepTest, ARefusedWriteFailsTheRun) {
  ServerRig rig;
  rig.failing_states = 1;
  rig.join("pilot");
  EXPECT_EQ(rig.core().error(), "write refused");
}

// --- absence -------------------------------------------------------------------------------------

TEST(ServerLockstepTest, PoliciesWaitAndStopNameTheControllerAndGiveUpAtTheDeadline) {
  for (const auto policy : {config::ControllerPolicy::kWait, config::ControllerPolicy::kStop}) {
    ServerRig rig(with_policy(policy, 10));
    rig.join("pilot");
    rig.take_log();
    rig.wait_until(999);
    EXPECT_EQ(rig.take_log(), Lines{});
    rig.wait_until(1001);
    EXPECT_EQ(rig.take_log(),
              Lines{"1000: step 0: waiting for: controller 'pilot' on box (9 s left)"});
    rig.wait_until(9'999);
    EXPECT_EQ(rig.phase(), Phase::kAwaitingAnswers);
    rig.wait_until(10'001);
    EXPECT_EQ(rig.core().error(), "step 0: waited 10 s for controller 'pilot' on box");
  }
}

TEST(ServerLockstepTest, AnAbsentControllerOfAFleetIsNamedWithItsVehicles) {
  for (const bool is_one_answered : {false, true}) {
    ServerRig rig(with_two_vehicles(with_policy(config::ControllerPolicy::kWait, 10)));
    rig.join("pilot");
    rig.take_log();
    if (is_one_answered) rig.answer("pilot", for_vehicles({0}));
    rig.wait_until(1500);
    EXPECT_EQ(rig.take_log(), Lines{std::string("1000: step 0: waiting for: controller 'pilot' on "
                                                "box (vehicle") +
                                    (is_one_answered ? " 1" : "s 0-1") + ") (9 s left)"});
    rig.answer("pilot", for_vehicles({0, 1}));
    EXPECT_EQ(rig.take_log(), Lines{"1500: step 0: all vehicles get answers again after 1.5 s"});
  }
}

TEST(ServerLockstepTest, TheVehicleThatHasWaitedLongestDecidesWhenToGiveUp) {
  auto scenario = with_two_vehicles(with_policy(config::ControllerPolicy::kHold, 1));
  scenario.sync.wait_for.timeout_s = 1.02;
  ServerRig rig(scenario);
  rig.join("pilot");
  rig.answer("pilot", for_vehicles({1}));
  rig.wait_until(1010);  // vehicle 0 is flown without answers; vehicle 1 waits since step 1
  EXPECT_EQ(rig.phase(), Phase::kAwaitingAnswers);
  rig.wait_until(1030);
  EXPECT_EQ(rig.core().error(),
            "step 1: waited 1.02 s for controller 'pilot' on box (vehicles 0-1)");
}

TEST(ServerLockstepTest, AnAwaitedControllerIsNamedWithWhatIsKnownOfIt) {
  struct Case {
    void (*happens)(ServerRig&);
    const char* expected;
  };
  for (const Case& given : {
           Case{[](ServerRig& rig) { rig.leave("pilot"); },
                "0: waiting for: controller (none is "
                "ready) (9 s left)"},
           Case{[](ServerRig& rig) {
                  rig.answer("pilot", 0);
                  rig.leave("pilot");
                },
                "1: waiting for: controller 'pilot' (gone) (9 s left)"},
           Case{[](ServerRig& rig) {
                  rig.show_controllers();
                  ServerRig::Answer other;
                  other.run_id = 1;
                  rig.answer("pilot", other);
                },
                "0: waiting for: controller 'pilot' on box (1 of its answers rejected, none taken: "
                "run_id: expected 00000000000001f4, got 0000000000000001) (9 s left)"},
           Case{[](ServerRig& rig) { rig.problem = "a mistake"; },
                "0: waiting for: controller 'pilot' on box (9 s left); a mistake"},
       }) {
    ServerRig rig(with_policy(config::ControllerPolicy::kWait, 10));
    rig.join("pilot");
    given.happens(rig);
    rig.take_log();
    rig.wait_until(1001);
    EXPECT_EQ(rig.take_log(), Lines{std::string("1000: step ") + given.expected});
  }
}

TEST(ServerLockstepTest, EachVehicleOfAFleetMayAwaitAnotherController) {
  auto scenario = with_two_vehicles(with_policy(config::ControllerPolicy::kWait, 0.3));
  scenario.sync.take_over_s = 5;
  ServerRig rig(scenario);
  rig.join("pilot", 1);
  rig.join("standby");
  ServerRig::Answer broken;
  broken.error_code = model::ErrorCode::kFreeFall;
  rig.answer("pilot", broken);
  rig.wait_until(399);
  EXPECT_EQ(
      rig.core().error(),
      "vehicle 0: controller 'pilot' answered step 0 with a fault: free_fall; waited 0.3 s for "
      "controller 'pilot' on box (vehicle 1), controller 'standby' on box (vehicle 0)");
}

TEST(ServerLockstepTest, AnAnswerAfterALongWaitIsAnnounced) {
  ServerRig rig(with_policy(config::ControllerPolicy::kWait, 10));
  rig.join("pilot");
  rig.wait_until(1500);
  rig.take_log();
  rig.answer("pilot", 0);
  EXPECT_EQ(rig.take_log(), Lines{"1500: step 0: controller 'pilot' answers again after 1.5 s"});
  EXPECT_EQ(rig.step(), 1u);
}

TEST(ServerLockstepTest, PolicyHoldFliesTheLastForceAPeriodOfWallTimeEachThenTheFailSafe) {
  auto scenario = with_policy(config::ControllerPolicy::kHold, 1);
  scenario.sync.max_hold_s = 0.008;
  ServerRig rig(scenario);
  rig.join("pilot");
  rig.answer("pilot", 0);
  rig.take_states();
  rig.take_log();
  rig.wait_until(999);
  EXPECT_EQ(rig.step(), 1u);
  rig.wait_until(1009);
  EXPECT_EQ(rig.step(), 4u);
  EXPECT_EQ(rig.take_records(), (Lines{"0 accepted", "1 held", "2 held", "3 fail-safe"}));
  EXPECT_EQ(rig.take_log(),
            (Lines{"1000: step 1: no answer from controller 'pilot' on box; holding the last force",
                   "1000: step 1: waiting for: controller 'pilot' on box (29 s left)",
                   "1008: step 3: no answer from controller 'pilot' on box; applying the fail-safe "
                   "force"}));
  rig.answer("pilot", 4);
  rig.wait_until(2000);
  EXPECT_EQ(rig.step(), 5u) << "the deadline counts again";
  EXPECT_EQ(rig.status().timing().to_string(), "degraded: 2 steps held, 1 fail-safe");
}

TEST(ServerLockstepTest, PolicyFailSafeUsesTheFailSafeFromTheBeginning) {
  ServerRig rig(with_policy(config::ControllerPolicy::kFailsafe, 1));
  rig.join("pilot");
  rig.wait_until(999);
  EXPECT_EQ(rig.take_records(), Lines{});
  rig.wait_until(1000);
  EXPECT_EQ(rig.take_records(), Lines{"0 fail-safe"});
  rig.wait_until(29'999);
  EXPECT_EQ(rig.phase(), Phase::kAwaitingAnswers);
  rig.wait_until(30'004);
  EXPECT_EQ(rig.core().end(), End::kFailed) << "wait_for.timeout_s";
}

TEST(ServerLockstepTest, ALateAnswerBringsItsClientBack) {
  for (const auto policy : {config::ControllerPolicy::kHold, config::ControllerPolicy::kFailsafe}) {
    ServerRig rig(with_policy(policy, 1));
    rig.join("far");  // its round trip of 10 ms is longer than a period
    rig.wait_until(1009);
    EXPECT_EQ(rig.step(), 3u);
    rig.take_records();
    rig.answer("far", 0);
    rig.answer("far", 1);
    rig.wait_until(1018);
    EXPECT_EQ(rig.step(), 3u) << "it is awaited again";
    rig.answer("far", 2);
    rig.answer("far", 3);
    EXPECT_EQ(rig.take_records(), (Lines{"late 0", "late 1", "late 2", "3 accepted"}));
    EXPECT_EQ(rig.step(), 4u);
  }
}

TEST(ServerLockstepTest, APauseIsNoAbsence) {
  ServerRig rig(with_policy(config::ControllerPolicy::kWait, 1));
  rig.join("pilot");
  rig.answer("pilot", 0);
  rig.request(ControlAction::ACTION_PAUSE);
  rig.wait_until(5000);
  EXPECT_EQ(rig.phase(), Phase::kAwaitingAnswers) << "the step in work still waits for its answer";
  rig.request(ControlAction::ACTION_RESUME);
  rig.wait(900);
  EXPECT_EQ(rig.phase(), Phase::kAwaitingAnswers);
  rig.wait(200);
  EXPECT_EQ(rig.core().end(), End::kFailed);
}

TEST(ServerLockstepTest, TheNextClientTakesOverAfterItsTimeAndTheFirstComesBack) {
  ServerRig rig;
  rig.join("pilot", 1);
  rig.join("standby");
  rig.take_log();
  rig.answer("standby", 0);
  rig.wait_until(99);
  EXPECT_EQ(rig.step(), 0u) << "its answer is kept";
  rig.wait_until(100);
  EXPECT_EQ(rig.step(), 1u);
  EXPECT_EQ(rig.take_log(), Lines{"100: step 0: controller 'standby' takes over from 'pilot'"});
  rig.answer("standby", 1);
  EXPECT_EQ(rig.step(), 2u) << "the silent one is skipped";
  rig.answer("pilot", 2);
  EXPECT_EQ(rig.step(), 3u);
  EXPECT_EQ(rig.status().counters().take_overs(), 2u);
}

TEST(ServerLockstepTest, EachSilentClientIsAwaitedForItsOwnTime) {
  ServerRig rig;
  rig.join("pilot", 2);
  rig.join("second", 1);
  rig.join("third");
  for (const char* name : {"second", "third", "pilot", "third"}) rig.answer(name, rig.step());
  rig.wait_until(199);
  EXPECT_EQ(rig.step(), 1u);
  rig.wait_until(201);
  EXPECT_EQ(rig.step(), 2u);
}

TEST(ServerLockstepTest, APausedStepIsNotFlownWithoutItsAnswer) {
  ServerRig rig(with_policy(config::ControllerPolicy::kHold, 1));
  rig.join("pilot");
  rig.wait_until(500);
  rig.request(ControlAction::ACTION_PAUSE);
  rig.wait_until(20'000);
  rig.request(ControlAction::ACTION_RESUME);
  rig.take_log();
  rig.wait_until(20'490);
  EXPECT_EQ(rig.take_records(), Lines{}) << "0.99 s of 1 s";
  EXPECT_EQ(rig.take_log(), Lines{}) << "a pause is no wait that is reported";
  rig.wait_until(20'520);
  EXPECT_EQ(rig.take_records().front(), "0 fail-safe");
}

// --- recorders -----------------------------------------------------------------------------------

config::Scenario with_recorder(config::RecorderPolicy policy) {
  auto scenario = ServerRig::make_scenario();
  scenario.sync.wait_for.recorders = 1;
  scenario.sync.wait.recorder.policy = policy;
  scenario.sync.wait.recorder.deadline_s = 10;
  std::get<config::LeaveAfter>(scenario.mission.front().leave).duration_ns = 60'000'000'000;
  return scenario;
}

TEST(ServerLockstepTest, TheServerStaysWithinTheWindowOfTheRecorder) {
  ServerRig rig(with_recorder(config::RecorderPolicy::kWait));
  rig.note_recorder("disk", -1);
  rig.join("pilot");
  rig.fly_to(1999);
  EXPECT_EQ(rig.phase(), Phase::kAwaitingRecorders) << "2,000 steps ahead of the last complete one";
  EXPECT_EQ(rig.step(), 1999u);
  rig.note_recorder("disk", 0);
  EXPECT_EQ(rig.step(), 2000u);
}

TEST(ServerLockstepTest, AMissingRecorderEndsTheRunAtTheDeadlineOrIsGivenUp) {
  for (const bool goes_on : {false, true}) {
    ServerRig rig(
        with_recorder(goes_on ? config::RecorderPolicy::kGoOn : config::RecorderPolicy::kWait));
    rig.note_recorder("disk", -1);
    rig.join("pilot");
    const auto waits_at_the_end = [&] {
      return !rig.core().leave(sync::at(0)).look({{}, 0, false, true}, sync::at(0));
    };
    rig.take_log();
    rig.leave("disk");
    rig.answer("pilot", 0);
    EXPECT_EQ(rig.phase(), Phase::kAwaitingRecorders);
    rig.wait_until(1000);
    EXPECT_EQ(rig.take_log(),
              Lines{"1000: step 1: waiting for: recorder: 1 expected, 0 there (9 s left)"});
    rig.wait_until(9'999);
    EXPECT_EQ(rig.phase(), Phase::kAwaitingRecorders);
    rig.wait_until(10'001);
    const std::string waited = "step 1: waited 10 s for recorder: 1 expected, 0 there";
    if (!goes_on) {
      EXPECT_EQ(rig.core().error(), waited);
      continue;
    }
    EXPECT_EQ(rig.take_log().back(), "10000: " + waited + ": continues without it");
    EXPECT_FALSE(waits_at_the_end());
    rig.fly_to(5);
    EXPECT_EQ(rig.step(), 6u);
    rig.note_recorder("disk", 6);
    rig.fly_to(6);
    EXPECT_EQ(rig.take_log().back(), "10001: step 7: the recorders are back");
    EXPECT_TRUE(waits_at_the_end());
  }
}

TEST(ServerLockstepTest, EachWaitForRecordersHasItsWholeTime) {
  auto scenario = with_recorder(config::RecorderPolicy::kWait);
  scenario.sync.wait.controller = {config::ControllerPolicy::kWait, 60};
  ServerRig rig(scenario);
  rig.note_recorder("disk", -1);
  rig.join("pilot");
  for (std::uint64_t step = 0; step < 2; ++step) {
    rig.leave("disk");
    rig.answer("pilot", step);
    rig.wait(900);  // too short for a line
    EXPECT_EQ(rig.phase(), Phase::kAwaitingRecorders);
    rig.note_recorder("disk", static_cast<std::int64_t>(step));
    EXPECT_EQ(rig.step(), step + 1);
    rig.wait(9'500);
  }
  EXPECT_EQ(rig.core().error(), "");
}

TEST(ServerLockstepTest, WhileTheFullQueueGetsShorterTheWaitGoesOn) {
  ServerRig rig(with_recorder(config::RecorderPolicy::kWait));
  rig.note_recorder("disk", -1);
  rig.join("pilot");
  rig.is_queue_full = true;
  rig.answer("pilot", 0);
  EXPECT_EQ(rig.phase(), Phase::kAwaitingRecorders);
  rig.wait_until(9'000);
  rig.written = 100;
  rig.wait_until(18'999);
  EXPECT_EQ(rig.phase(), Phase::kAwaitingRecorders);
  rig.is_queue_full = false;
  rig.wait(1);
  EXPECT_EQ(rig.step(), 1u);
  EXPECT_EQ(rig.take_log().back(), "19000: step 1: the recorders are back");
  rig.is_queue_full = true;
  rig.answer("pilot", 1);
  rig.wait(10'002);
  EXPECT_EQ(rig.core().error(),
            "step 2: waited 10 s for recorder: the queue of sls/record is full");
}

TEST(ServerLockstepTest, ASilentRecorderThatIsBehindIsNamed) {
  ServerRig rig(with_recorder(config::RecorderPolicy::kWait));
  rig.note_recorder("disk", -1);
  rig.join("pilot");
  rig.fly_to(5);
  rig.take_log();
  rig.fall_silent("disk");
  rig.wait_until(1400);
  const Lines log = rig.take_log();
  EXPECT_NE(std::find(log.begin(), log.end(),
                      "1400: step 6: recorder 'disk' on box is silent since step -1"),
            log.end())
      << testing::PrintToString(log);
  const auto count = [&] {
    const Lines later = rig.take_log();
    return std::count_if(later.begin(), later.end(), [](const std::string& line) {
      return line.find("is silent since") != std::string::npos;
    });
  };
  rig.wait_until(6399);
  EXPECT_EQ(count(), 0) << "it is named every 5 s";
  rig.wait_until(7000);
  EXPECT_EQ(count(), 1);
}

TEST(ServerLockstepTest, InAPauseNobodyIsSilent) {
  auto scenario = with_recorder(config::RecorderPolicy::kWait);
  scenario.sync.wait.controller = {config::ControllerPolicy::kWait, 10};
  ServerRig rig(scenario);
  rig.repeats_announcements = false;
  rig.note_recorder("disk", -1);
  rig.join("pilot");
  rig.request(ControlAction::ACTION_PAUSE);
  rig.answer("pilot", 0);
  rig.fall_silent("disk");
  rig.take_log();
  rig.wait(1900);  // a recorder that is silent for longer is dead
  EXPECT_EQ(rig.take_log(), Lines{});
  rig.note_recorder("disk", 0);
  rig.fall_silent("pilot");
  rig.wait(5000);
  rig.note_recorder("disk", 0);
  rig.request(ControlAction::ACTION_RESUME);
  rig.take_log();
  rig.wait(1001);
  EXPECT_EQ(rig.take_log(),
            Lines{"7900: step 1: waiting for: controller 'pilot' on box (9 s left)"})
      << "it could not answer";
}

// --- operator ------------------------------------------------------------------------------------

TEST(ServerLockstepTest, APausedRunFliesTheStepsThatAreRequested) {
  ServerRig rig;
  rig.join("pilot");
  rig.take_log();
  rig.request(ControlAction::ACTION_PAUSE);
  EXPECT_EQ(rig.take_log(), Lines{"0: step 0: paused by anna@box"});
  rig.request(ControlAction::ACTION_PAUSE);
  EXPECT_EQ(rig.take_log(), Lines()) << "a refused request is no event";
  EXPECT_EQ(rig.phase(), Phase::kAwaitingAnswers) << "the step in work is completed";
  rig.answer("pilot", 0);
  EXPECT_EQ(rig.phase(), Phase::kResting);
  EXPECT_EQ(rig.take_records(), (Lines{"0 accepted", "flush"}));
  EXPECT_EQ(rig.status().phase(), RunPhase::PHASE_PAUSED);
  rig.request(ControlAction::ACTION_STEP, 2);
  rig.fly_to(2);
  EXPECT_EQ(rig.phase(), Phase::kResting);
  ASSERT_EQ(rig.replies().size(), 3u);
  EXPECT_TRUE(rig.replies().back().accepted());
  EXPECT_EQ(rig.replies().back().step(), 3u);
  rig.request(ControlAction::ACTION_RESUME);
  EXPECT_EQ(rig.step(), 3u);
}

TEST(ServerLockstepTest, ResetEndsTheRunWhereverItIs) {
  ServerRig rig;
  rig.join("pilot");
  rig.request(ControlAction::ACTION_PAUSE);
  rig.answer("pilot", 0);
  rig.request(ControlAction::ACTION_STEP, 10);
  rig.request(ControlAction::ACTION_RESET);
  EXPECT_EQ(rig.core().end(), End::kReset);
  EXPECT_TRUE(rig.core().is_paused()) << "so begins its successor";
  EXPECT_EQ(rig.status().phase(), RunPhase::PHASE_RESET);
  EXPECT_EQ(rig.status().reason().to_string(), "reset by anna@box");
  EXPECT_EQ(rig.replies().back().reason().to_string(), "0 of 10 steps done: reset by anna@box");
  rig.fail("its successor cannot be made");
  EXPECT_EQ(rig.core().end(), End::kFailed);
  EXPECT_EQ(rig.status().phase(), RunPhase::PHASE_FAILED);
}

TEST(ServerLockstepTest, StopAndASignalFailTheRunWithTheirNames) {
  ServerRig by_operator, by_signal;
  by_operator.join("pilot");
  by_operator.request(ControlAction::ACTION_STOP);
  EXPECT_EQ(by_operator.core().error(), "stopped by anna@box");
  by_signal.join("pilot");
  by_signal.wait_until(20);
  by_signal.stop("interrupted by SIGINT");
  by_signal.wait(20);
  EXPECT_EQ(by_signal.core().error(), "interrupted by SIGINT");
  EXPECT_EQ(by_signal.take_records(), (Lines{"0 none", "end"}));
}

// --- reports -------------------------------------------------------------------------------------

TEST(ServerLockstepTest, AStatusComesAtLeastEveryHalfSecond) {
  ServerRig rig;
  rig.join("pilot");
  const std::size_t before = rig.statuses().size();
  rig.wait_until(399);
  EXPECT_EQ(rig.statuses().size(), before);
  rig.wait_until(420);
  EXPECT_EQ(rig.statuses().size(), before + 1);
}

TEST(ServerLockstepTest, WhatTheAnswersOfAControllerShowIsReported) {
  for (const bool is_ahead : {true, false}) {
    ServerRig rig;
    rig.join("pilot");
    rig.show_controllers();
    ServerRig::Answer answer;
    answer.clock_ahead_ms = is_ahead ? 5040 : 0;
    answer.run_id = is_ahead ? ServerRig::kRunId : 1;
    rig.answer("pilot", answer);
    rig.wait(is_ahead ? 500 : 5000);
    EXPECT_EQ(rig.status().problem().to_string(),
              is_ahead ? "controller 'pilot' on box: sls/command source timestamp: expected none "
                         "in the future, got 5.0 s ahead of our clock"
                       : "controller 'pilot' on box: sls/command: 1 answers rejected, none taken: "
                         "run_id: expected 00000000000001f4, got 0000000000000001");
  }
}

TEST(ServerLockstepTest, AMistakeThatMustLastIsReportedWhenItHas) {
  ServerRig rig;
  rig.join("pilot");
  rig.request(ControlAction::ACTION_PAUSE);
  rig.answer("pilot", 0);
  rig.wait_until(450);
  rig.neighbourhood.command_writers[sync::peer(9)] = "'foo' (10.0.0.2)";
  rig.wait_until(4799);  // the status at 800 came with the first look that saw it
  EXPECT_EQ(rig.status().problem().to_string(), "");
  rig.wait_until(4800);
  EXPECT_EQ(rig.status().problem().to_string(),
            "'foo' (10.0.0.2): writes sls/command: expected an announcement in sls/participant, "
            "got none");
}

TEST(ServerLockstepTest, ARemarkOfAPlantAtItsStartIsAnEventAtOnceOrAtTheEnd) {
  auto scenario = ServerRig::make_scenario();
  const auto multirotor =
      config::load_scenario(SLS_SOURCE_DIR "/config/scenarios/multirotor_figure_eight.yaml");
  scenario.plant = multirotor.plant;
  scenario.autopilot = multirotor.autopilot;
  scenario.plant.own.edit<MultirotorKeys>().rotor.torque_constant = 0.0;
  for (const bool ends : {false, true}) {
    ServerRig rig(scenario);
    ends ? rig.fail("a failure") : rig.join("pilot");
    EXPECT_EQ(rig.take_log().front(),
              "0: vehicle 0: the rotors have no authority over yaw: they cannot turn the vehicle "
              "about z alone");
  }
}

TEST(ServerLockstepTest, ARemarkOfAPlantIsAnEventOfItsStep) {
  auto scenario = config::load_scenario(SLS_SOURCE_DIR "/config/scenarios/two_carry_a_bar.yaml");
  scenario.sync.wait_for.recorders = 0;
  ServerRig rig(scenario);
  rig.join("pilot");
  ServerRig::Answer answer;
  answer.vehicle_ids = {0, 1};
  rig.answer("pilot", answer);
  EXPECT_EQ(rig.status().step(), 0u);
  rig.take_log();
  answer.step = 1;
  answer.more_force = -50.0;  // downwards: both vehicles dive at once
  rig.answer("pilot", answer);
  EXPECT_EQ(rig.status().step(), 2u);
  const std::string slack = "cable slack at 0.004000000 s; no cable carries the load";
  EXPECT_EQ(rig.status().reason().to_string(), "vehicle 1: " + slack);
  EXPECT_EQ(rig.take_log(), (Lines{"0: vehicle 0: " + slack, "0: vehicle 1: " + slack}));
}

TEST(ServerLockstepTest, AMistakeOfAParticipantIsInTheStatusWithinTheTimeOfALook) {
  ServerRig rig;
  rig.join("pilot");
  rig.wait_until(130);
  rig.problem = "'foo' (10.0.0.2): another vendor's DDS";
  rig.wait(120);
  EXPECT_EQ(rig.status().problem().to_string(), rig.problem);
}

TEST(ServerLockstepTest, APauseIsNoWaitForRecorders) {
  ServerRig rig(with_recorder(config::RecorderPolicy::kWait));
  rig.note_recorder("disk", -1);
  rig.join("pilot");
  rig.leave("disk");
  rig.answer("pilot", 0);
  rig.wait(5000);
  rig.request(ControlAction::ACTION_PAUSE);
  rig.wait(20'000);
  rig.request(ControlAction::ACTION_RESUME);
  rig.wait(4900);
  EXPECT_EQ(rig.core().error(), "");
  rig.wait(200);
  EXPECT_NE(rig.core().error(), "");
}

TEST(ServerLockstepTest, AWaitForRecordersIsNoAbsenceOfTheController) {
  auto scenario = with_recorder(config::RecorderPolicy::kWait);
  scenario.sync.wait.controller = {config::ControllerPolicy::kHold, 1};
  scenario.sync.wait_for.timeout_s = 5;
  ServerRig rig(scenario);
  rig.note_recorder("disk", -1);
  rig.join("pilot");
  rig.leave("disk");
  rig.wait(1100);  // step 0 is flown without an answer; step 1 waits for a recorder
  rig.wait(8000);
  rig.note_recorder("disk", 0);
  rig.wait(1000);
  EXPECT_EQ(rig.core().error(), "");
}

}  // namespace
}  // namespace sls::sim
