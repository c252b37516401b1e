// A run in real time: docs/synchronisation.md, "Real time". The period is 4 ms.
#include <gtest/gtest.h>

#include "tests/sim_server/core/server_rig.hpp"

namespace sls::sim {
namespace {

using namespace std::chrono_literals;
using End = ServerCore::End;

class ServerRealtimeTest : public testing::Test {
 protected:
  void SetUp() override {
    rig_.join("pilot", 1);
    rig_.take_log();
  }
  /// Answers each state 1 ms after it was due, up to and including `last`.
  void fly_to(std::uint64_t last) {
    for (std::uint64_t step = rig_.step(); step <= last; ++step) {
      rig_.wait_until(static_cast<std::int64_t>(step) * 4 + 1);
      rig_.answer("pilot", step);
    }
  }

  /// Flies up to step 250, and answers it when it is over: that it ends the mission.
  ServerRig::Answer end_late() {
    fly_to(249);
    rig_.wait_until(1004);
    ServerRig::Answer last{250};
    last.is_last = true;
    rig_.answer("pilot", last);
    return last;
  }

  ServerRig rig_{ServerRig::make_realtime_scenario()};
};

TEST_F(ServerRealtimeTest, EachStateLeavesWhenItIsDue) {
  fly_to(2);
  rig_.wait_until(11);
  EXPECT_EQ(rig_.take_states(), (Lines{"0: state 0", "4: state 1", "8: state 2"}));
  rig_.wait_until(12);
  EXPECT_EQ(rig_.take_states(), Lines{"12: state 3"});
  EXPECT_EQ(rig_.take_records(), (Lines{"0 accepted", "1 accepted", "2 accepted"}));
  rig_.wait_until(600);
  EXPECT_EQ(rig_.status().round_trip_p50_ns(), 1'000'000u);
  EXPECT_NEAR(rig_.status().real_time_factor(), 1.0, 0.02);
}

TEST_F(ServerRealtimeTest, AnAnswerCountsUntilTheNextStateIsDue) {
  rig_.wait_until(3);
  rig_.answer("pilot", 0);
  EXPECT_EQ(rig_.take_records(), Lines{"0 accepted"});
  rig_.wait_until(8);
  EXPECT_EQ(rig_.take_records(), Lines{"1 held"});
}

TEST_F(ServerRealtimeTest, ALateAnswerIsRecordedAndHeldFromThenOn) {
  rig_.wait_until(4);
  EXPECT_EQ(rig_.take_records(), Lines{"0 fail-safe"}) << "there is nothing to hold";
  rig_.answer("pilot", 0);
  rig_.wait_until(8);
  EXPECT_EQ(rig_.take_records(), (Lines{"late 0", "1 held"}));
}

TEST_F(ServerRealtimeTest, AfterMaxHoldTheFailSafeActsUntilAFreshAnswer) {
  auto scenario = ServerRig::make_realtime_scenario();
  scenario.sync.max_hold_s = 0.008;
  ServerRig rig(scenario);
  rig.join("pilot");
  rig.answer("pilot", 0);
  rig.wait_until(16);
  EXPECT_EQ(rig.take_records(), (Lines{"0 accepted", "1 held", "2 held", "3 fail-safe"}));
  rig.answer("pilot", 4);
  rig.wait_until(24);
  EXPECT_EQ(rig.take_records(), (Lines{"4 accepted", "5 held"}));
  rig.wait_until(500);
  EXPECT_GT(rig.status().counters().fail_safe(), 1u);
}

TEST_F(ServerRealtimeTest, AnAnswerToAStateThatHasNotLeftIsRefused) {
  fly_to(0);
  rig_.answer("pilot", 1);
  rig_.wait_until(5);
  ServerRig::Answer queued{1};
  queued.queued_ms = 2;  // it came before the state left at 4 ms
  rig_.answer("pilot", queued);
  rig_.wait_until(8);
  EXPECT_EQ(rig_.take_records(), (Lines{"0 accepted", "1 held"}));
}

TEST_F(ServerRealtimeTest, AVehicleOfAFleetWithoutAnAnswerDelaysNoOther) {
  auto scenario = ServerRig::make_realtime_scenario();
  scenario.vehicles.resize(2, scenario.vehicles.front());
  ServerRig rig(scenario);
  rig.join("pilot");
  rig.answer("pilot", 0);  // for vehicle 0
  rig.wait_until(3);
  EXPECT_EQ(rig.take_records(), Lines{});
  rig.wait_until(4);
  EXPECT_EQ(rig.take_records(), (Lines{"0 accepted", "0 fail-safe"}));
}

TEST_F(ServerRealtimeTest, AServerThatIsFarBehindMovesItsSchedule) {
  fly_to(0);
  rig_.jump_to(40 + 4 + 50);  // stopped, such as by SIGSTOP
  rig_.take_states();
  rig_.wait(4);
  rig_.answer("pilot", 2);
  rig_.wait_until(500);
  EXPECT_EQ(rig_.status().counters().slipped(), 1u);
}

TEST_F(ServerRealtimeTest, ALateServerLeavesEveryAnswerAQuarterOfAPeriod) {
  fly_to(0);
  rig_.jump_to(30);
  EXPECT_EQ(rig_.take_states().back(), "30: state 1");
  rig_.answer("pilot", 1);
  rig_.wait_until(30);
  EXPECT_EQ(rig_.take_states(), Lines{"30: state 2"});
  rig_.wait_until(31);
  EXPECT_EQ(rig_.take_states(), Lines{"31: state 3"}) << "it catches up";
  EXPECT_EQ(rig_.take_records().back(), "2 held");
}

TEST_F(ServerRealtimeTest, ThreeMissesInARowAreATakeOver) {
  rig_.join("standby");
  for (std::uint64_t step = 0; step < 3; ++step) {
    rig_.wait_until(static_cast<std::int64_t>(step) * 4 + 1);
    rig_.answer("standby", step);
  }
  rig_.wait_until(12);
  EXPECT_EQ(rig_.take_records(), (Lines{"0 fail-safe", "1 fail-safe", "2 accepted"}));
  EXPECT_EQ(rig_.take_log(), Lines{"12: step 2: controller 'standby' takes over from 'pilot'"});
}

TEST_F(ServerRealtimeTest, ATakeOverComesSoonerIfItsTimeIsShort) {
  auto scenario = ServerRig::make_realtime_scenario();
  scenario.sync.take_over_s = 0.008;
  ServerRig rig(scenario);
  rig.join("pilot", 1);
  rig.join("standby");
  rig.take_log();
  rig.answer("standby", 0);
  rig.wait_until(5);
  rig.answer("standby", 1);
  rig.wait_until(8);
  EXPECT_EQ(rig.take_records(), (Lines{"0 fail-safe", "1 accepted"}));
  EXPECT_EQ(rig.take_log(), Lines{"8: step 1: controller 'standby' takes over from 'pilot'"});
}

TEST_F(ServerRealtimeTest, AnAbsentControllerIsNamedAndEndsTheRunAtTheDeadline) {
  fly_to(0);
  rig_.wait_until(30'000);
  const Lines log = rig_.take_log();
  EXPECT_EQ(
      log.front(),
      "508: step 126: no answer from controller 'pilot' on box; applying the fail-safe force");
  EXPECT_EQ(log[1].rfind("1004: step 250: waiting for: controller 'pilot' on box (", 0), 0u)
      << log[1];
  rig_.wait_until(40'000);
  EXPECT_EQ(rig_.core().end(), End::kFailed);
  EXPECT_NE(rig_.core().error().find("s for controller 'pilot' on box"), std::string::npos);
}

TEST_F(ServerRealtimeTest, APauseMovesTheSchedule) {
  fly_to(0);
  rig_.request(ControlAction::ACTION_PAUSE);
  EXPECT_EQ(rig_.phase(), Phase::kResting);
  rig_.wait_until(1001);
  rig_.missed_deadlines = 3;
  rig_.wait_until(1020);
  rig_.request(ControlAction::ACTION_RESUME);
  rig_.take_states();
  rig_.wait_until(1024);
  EXPECT_EQ(rig_.take_states(), Lines{"1023: state 1"});
  rig_.wait_until(1500);
  EXPECT_EQ(rig_.status().counters().deadline_missed(), 0u) << "no command was due";
  EXPECT_EQ(rig_.status().counters().slipped(), 0u);
}

TEST_F(ServerRealtimeTest, MissedDeadlinesAndLostSamplesAreCounted) {
  fly_to(10);
  rig_.missed_deadlines = 2;
  rig_.lost_samples = 5;
  rig_.wait_until(900);
  EXPECT_EQ(rig_.status().counters().deadline_missed(), 2u);
  EXPECT_EQ(rig_.status().counters().overflow(), 5u);
}

TEST_F(ServerRealtimeTest, ALateEndWaitsForTheAnswerToTheLastState) {
  fly_to(249);
  rig_.wait_until(1004);  // state 250 is over
  rig_.take_records();
  rig_.take_states();
  ServerRig::Answer last{250};
  last.is_last = true;
  rig_.answer("pilot", last);
  rig_.wait_until(1057);
  EXPECT_EQ(rig_.phase(), Phase::kAwaitingAnswers);
  rig_.wait_until(1058);
  EXPECT_EQ(rig_.take_states(), Lines{"1058: state 251 again"});
  last.step = 251;
  rig_.answer("pilot", last);
  EXPECT_EQ(rig_.core().end(), End::kFinished);
  EXPECT_EQ(rig_.take_records(), (Lines{"late 250", "251 accepted", "end"}));
}

TEST_F(ServerRealtimeTest, ALateEndWithoutALastAnswerFailsAfterASecond) {
  rig_.lifespan = 100ms;
  end_late();
  rig_.wait_until(2007);
  EXPECT_EQ(rig_.phase(), Phase::kAwaitingAnswers);
  EXPECT_TRUE(rig_.is_lifespan_ignored()) << "its clock may be wrong";
  rig_.wait_until(2008);
  EXPECT_EQ(rig_.core().error(),
            "step 251: the mission was finished, but controller 'pilot' on box does not answer");
}

TEST_F(ServerRealtimeTest, AWithdrawnLateEndLeavesTheNextOneItsWholeTime) {
  ServerRig::Answer last = end_late();
  rig_.wait_until(1900);
  rig_.answer("pilot", 251);  // the mission goes on
  rig_.wait(5);
  last.step = 252;
  rig_.answer("pilot", last);
  rig_.wait(950);
  EXPECT_EQ(rig_.core().error(), "");
  EXPECT_EQ(rig_.step(), 253u);
}

TEST_F(ServerRealtimeTest, TheThirdSlowAnswerInARowIsNamedIfASecondHasPassed) {
  for (const std::uint64_t run_id : {ServerRig::kRunId + 1, ServerRig::kRunId}) {
    ServerRig rig(ServerRig::make_realtime_scenario());
    rig.join("pilot");
    for (const std::uint64_t step : {0, 150, 300}) {
      rig.take_log();
      rig.wait_until(static_cast<std::int64_t>(step) * 4 + 3);
      ServerRig::Answer slow{step};
      slow.run_id = run_id;
      slow.compute_ms = 200;
      rig.answer("pilot", slow);
    }
    const bool is_named =
        testing::PrintToString(rig.take_log()).find("computes an answer") != std::string::npos;
    EXPECT_EQ(is_named, run_id == ServerRig::kRunId) << "of another run it is no answer to us";
  }
}

TEST_F(ServerRealtimeTest, ALawThatTakesLongerThanAPeriodIsNamed) {
  for (std::uint64_t step = 0; step < 300; ++step) {
    rig_.wait_until(static_cast<std::int64_t>(step) * 4 + 3);
    ServerRig::Answer slow{step};
    slow.compute_ms = 200;
    rig_.answer("pilot", slow);
  }
  const Lines log = rig_.take_log();
  ASSERT_EQ(log.size(), 1u);
  EXPECT_EQ(log[0].rfind("1003: step 250: controller 'pilot' computes an answer for 200 ms", 0), 0u)
      << log[0];
}

TEST_F(ServerRealtimeTest, AClockThatIsWrongByHalfTheLifespanIsNamedAndLifespanIgnored) {
  rig_.lifespan = 100ms;
  const auto fly = [&](std::uint64_t from, std::uint64_t to, std::int64_t ahead_ms) {
    for (std::uint64_t step = from; step < to; ++step) {
      rig_.wait_until(static_cast<std::int64_t>(step) * 4 + 1);
      ServerRig::Answer answer{step};
      answer.clock_ahead_ms = ahead_ms;
      rig_.answer("pilot", answer);
      // Answers to states that it does not remember or has not sent measure nothing.
      answer.clock_ahead_ms = -9000;
      for (const std::uint64_t other : {step - 65, step + 5}) {
        answer.step = other;
        rig_.answer("pilot", answer);
      }
    }
  };
  fly(0, 100, 49);
  EXPECT_FALSE(rig_.is_lifespan_ignored());
  fly(100, 1300, 52);
  EXPECT_TRUE(rig_.is_lifespan_ignored());
  EXPECT_EQ(
      rig_.take_log().front().substr(6),
      "the clock of controller 'pilot' on box is 0.05 s ahead of ours: synchronise the clocks; "
      "until then its commands expire by their step, not by LIFESPAN");
  fly(1300, 2600, 0);
  EXPECT_FALSE(rig_.is_lifespan_ignored());
  EXPECT_EQ(rig_.take_log().front().substr(6),
            "the clock of controller 'pilot' on box agrees with ours again: its commands expire by "
            "LIFESPAN again");
  fly(2600, 3900, -52);
  EXPECT_NE(rig_.take_log().front().find("'pilot' on box is 0.05 s behind ours"),
            std::string::npos);
}

TEST_F(ServerRealtimeTest, LifespanIsIgnoredWhileAClientWithoutAnswersHasStampsThatAreOlder) {
  rig_.lifespan = 100ms;
  rig_.announcement_age = 100ms;
  rig_.wait_until(1500);
  EXPECT_FALSE(rig_.is_lifespan_ignored());
  rig_.announcement_age = 101ms;
  rig_.wait_until(1700);
  EXPECT_TRUE(rig_.is_lifespan_ignored());
  for (std::uint64_t step = rig_.step(); step < 500; ++step) {
    rig_.wait_until(static_cast<std::int64_t>(step) * 4 + 1);
    rig_.answer("pilot", step);
  }
  EXPECT_FALSE(rig_.is_lifespan_ignored()) << "only the announcement was late";
  for (const std::string& line : rig_.take_log())
    EXPECT_EQ(line.find("clock"), std::string::npos) << line;
}

TEST_F(ServerRealtimeTest, LifespanIsIgnoredAfterASecondOfSilenceOfAClientThatAnnouncesItselfOnce) {
  for (const bool repeats : {true, false}) {
    for (const bool has_answered : {true, false}) {
      ServerRig rig(ServerRig::make_realtime_scenario());
      rig.lifespan = 100ms;
      rig.repeats_announcements = repeats;
      rig.join("pilot");
      if (has_answered) rig.fly_to(100);
      // Its clock is set back: the middleware drops its next answers.
      const std::int64_t last = rig.ms();
      rig.wait_until(last + 1000);
      EXPECT_FALSE(rig.is_lifespan_ignored());
      rig.wait_until(last + 1200);
      EXPECT_EQ(rig.is_lifespan_ignored(), !repeats) << "has answered: " << has_answered;
    }
  }
}

TEST_F(ServerRealtimeTest, AnAnswerOlderThanTheLifespanIsStale) {
  rig_.lifespan = 10ms;
  fly_to(20);
  rig_.wait_until(100);
  rig_.take_records();
  rig_.answer("pilot", 22);
  rig_.wait_until(501);
  rig_.take_records();
  rig_.answer("pilot", 124);  // whose state was due 5 ms ago
  rig_.wait_until(504);
  EXPECT_EQ(rig_.take_records(), (Lines{"late 124", "125 held"}));
  rig_.wait_until(1000);
  EXPECT_EQ(rig_.status().counters().stale(), 1u);
}

TEST_F(ServerRealtimeTest, AMissingRecorderIsReportedAndOnlyTheStopPolicyEndsTheFlight) {
  for (const bool stops : {false, true}) {
    auto scenario = ServerRig::make_realtime_scenario();
    scenario.sync.wait_for.recorders = 1;
    scenario.sync.wait.recorder.policy =
        stops ? config::RecorderPolicy::kStop : config::RecorderPolicy::kWait;
    scenario.sync.wait.recorder.deadline_s = 2;
    scenario.sync.wait.controller.deadline_s = 60;
    ServerRig rig(scenario);
    rig.note_recorder("disk", -1);
    rig.join("pilot");
    rig.leave("disk");
    rig.take_log();
    std::int64_t ms = 0;
    for (std::uint64_t step = 0; rig.phase() != Phase::kEnded && step < 240; ++step, ms += 4) {
      rig.wait_until(ms + 1);
      rig.answer("pilot", step);
    }
    for (; rig.phase() != Phase::kEnded && ms < 2400; ms += 4) rig.wait_until(ms);
    const Lines log = rig.take_log();
    EXPECT_TRUE(std::any_of(log.begin(), log.end(), [](const std::string& line) {
      return line.find("continues without: recorder: 1 expected, 0 there") != std::string::npos;
    })) << testing::PrintToString(log);
    EXPECT_EQ(rig.phase() == Phase::kEnded, stops);
    EXPECT_EQ(rig.core().error().find("waited 2 s for recorder") != std::string::npos, stops);
  }
}

}  // namespace
}  // namespace sls::sim
