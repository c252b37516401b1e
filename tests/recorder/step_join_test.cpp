#include "recorder/step_join.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <random>
#include <variant>

#include "tests/recorder/synthetic_run.hpp"

namespace sls::record {
namespace {

using namespace std::chrono_literals;
using namespace test;
using Sample = std::variant<VehicleState, ControlCommand, Reference>;

class StepJoinTest : public testing::Test {
 protected:
  void add(const Sample& sample) {
    std::visit([&](const auto& message) { join_.add(message); }, sample);
  }
  void add_step(std::uint64_t step) {
    join_.add(make_state(step));
    join_.add(make_command(step));
    join_.add(make_reference(step));
  }
  void add_steps(std::uint64_t from, std::uint64_t to) {
    for (std::uint64_t step = from; step <= to; ++step) add_step(step);
  }

  /// What has come out is steps 0 to `last`, each with the pilot's three samples.
  void expect_whole_up_to(std::uint64_t last) {
    ASSERT_EQ(records_.size(), last + 1);
    for (std::uint64_t step = 0; step <= last; ++step) {
      const StepRecord& record = records_[step];
      ASSERT_EQ(record.step, step);
      ASSERT_TRUE(record.is_complete()) << step;
      ASSERT_EQ(*record.state, make_state(step));
      ASSERT_EQ(*record.command, make_command(step));
      ASSERT_EQ(*record.reference, make_reference(step));
    }
    EXPECT_EQ(join_.last_step(), static_cast<std::int64_t>(last));
  }

  std::vector<StepRecord> records_;
  StepJoin join_{[this](const StepRecord& record) { records_.push_back(record); }};
};

TEST_F(StepJoinTest, NothingIsHandedOnBeforeThereIsAnything) {
  EXPECT_EQ(join_.last_step(), -1);
  EXPECT_FALSE(join_.has_ended());
  join_.give_up();
  EXPECT_TRUE(records_.empty());
}

TEST_F(StepJoinTest, AStepWaitsForTheNextStateThatSaysWhoseForceWasApplied) {
  add_step(0);
  EXPECT_TRUE(records_.empty());
  join_.add(make_state(1));
  expect_whole_up_to(0);
  add_step(1);
  EXPECT_EQ(records_.size(), 1u);
}

TEST_F(StepJoinTest, TheEndSettlesTheLastStep) {
  add_steps(0, kLastStep);
  EXPECT_EQ(join_.last_step(), static_cast<std::int64_t>(kLastStep) - 1);
  EXPECT_FALSE(join_.has_ended());
  join_.set_end(kLastStep, true, kPilot);
  EXPECT_TRUE(join_.has_ended());
  expect_whole_up_to(kLastStep);
}

TEST_F(StepJoinTest, TheEndMayBeKnownFirst) {
  join_.set_end(kLastStep, true, kPilot);
  EXPECT_FALSE(join_.has_ended());
  add_steps(0, kLastStep);
  EXPECT_TRUE(join_.has_ended());
  expect_whole_up_to(kLastStep);
}

TEST_F(StepJoinTest, AMissionMayEndAtStepZero) {
  ControlCommand only = make_command(0);
  only.mission(MISSION_FINISHED);
  join_.add(make_state(0));
  join_.add(make_reference(0));
  join_.set_end(0, true, kPilot);
  EXPECT_FALSE(join_.has_ended());
  join_.add(only);
  EXPECT_TRUE(join_.has_ended());
  ASSERT_EQ(records_.size(), 1u);
  EXPECT_EQ(*records_[0].command, only);
}

TEST_F(StepJoinTest, WhatComesAfterTheEndIsNotHandedOn) {
  join_.set_end(3, false, kPilot);
  add_steps(0, 20);
  join_.give_up();
  EXPECT_EQ(records_.size(), 4u);
}

TEST_F(StepJoinTest, RepeatedSamplesAreDroppedAndCounted) {
  for (int i = 0; i < 3; ++i) {
    add_step(0);
    add_step(1);
  }
  join_.add(make_state(0));
  join_.set_end(1, false, kPilot);
  EXPECT_EQ(records_.size(), 2u);
  EXPECT_GE(join_.dropped().repeated, 2u * 6u);
  EXPECT_EQ(join_.dropped().out_of_range, 0u);
}

// --- which client's answer -----------------------------------------------------------------------

TEST_F(StepJoinTest, TheAnswerThatWasAppliedIsRecordedWhoeverWasFirst) {
  for (std::uint64_t step = 0; step <= kLastStep; ++step) {
    join_.add(make_standby_reference(step));
    join_.add(make_standby_command(step));
    join_.add(make_state(step));
    join_.add(make_command(step));
    join_.add(make_reference(step));
  }
  join_.set_end(kLastStep, true, kPilot);
  expect_whole_up_to(kLastStep);
  EXPECT_EQ(join_.dropped().other_client, kLastStep + 1);
}

TEST_F(StepJoinTest, AStandbysAnswerAloneIsNotEnough) {
  join_.add(make_state(0));
  join_.add(make_standby_command(0));
  join_.add(make_standby_reference(0));
  join_.add(make_state(1));
  EXPECT_TRUE(records_.empty());
  join_.add(make_command(0));
  join_.add(make_reference(0));
  expect_whole_up_to(0);
}

TEST_F(StepJoinTest, AfterATakeOverTheOtherClientsAnswersAreRecorded) {
  for (std::uint64_t step = 0; step <= 20; ++step) {
    VehicleState state = make_state(step);
    if (step > 10) {
      state.controller_name("standby");
      state.answer_f_Q_W_n(make_standby_command(step - 1).f_Q_W_n());
    }
    join_.add(state);
    join_.add(make_command(step));
    join_.add(make_reference(step));
    join_.add(make_standby_command(step));
    join_.add(make_standby_reference(step));
  }
  ASSERT_EQ(records_.size(), 20u);
  for (std::uint64_t step = 0; step < 20; ++step) {
    const std::string client = step < 10 ? kPilot : "standby";
    EXPECT_EQ(records_[step].command->client_name().to_string(), client) << step;
    EXPECT_EQ(records_[step].reference->client_name().to_string(), client) << step;
  }
}

TEST_F(StepJoinTest, OfOneNameTheCommandWhoseForceWasAppliedIsRecorded) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (std::uint64_t step = 0; step <= kLastStep; ++step) {
    // A stranger under the pilot's name: refused by the server, but the recorder hears it too.
    ControlCommand stranger = make_command(step);
    stranger.f_Q_W_n({1e9, 0, 0});
    stranger.mission(MISSION_RUNNING);
    ControlCommand not_finite = make_command(step);
    not_finite.f_Q_W_n({nan, nan, nan});
    for (int i = 0; i < 50; ++i) {
      join_.add(stranger);
      join_.add(not_finite);
    }
    add_step(step);
  }
  // At the end no next state tells the forces apart; only one of them ends the mission.
  ControlCommand stranger = make_command(kLastStep);
  stranger.mission(MISSION_FAILED);
  join_.add(stranger);
  join_.set_end(kLastStep, true, kPilot);
  ASSERT_EQ(records_.size(), kLastStep + 1);
  for (const StepRecord& record : records_) {
    ASSERT_TRUE(record.command) << record.step;
    ASSERT_EQ(record.command->f_Q_W_n(), make_command(record.step).f_Q_W_n()) << record.step;
    ASSERT_NE(record.command->mission(), MISSION_FAILED);
  }
}

TEST_F(StepJoinTest, TheEqualAnswerOfAStandbyStandsForWhatADyingClientKeptBack) {
  constexpr std::uint64_t kDeath = 5;  // the pilot's command got out, its reference did not
  const auto add_flight = [this](std::uint64_t last_step) {
    for (std::uint64_t step = 0; step <= last_step; ++step) {
      ControlCommand command = make_command(step);
      Reference reference = make_reference(step);
      join_.add(make_state(step));
      join_.add(command);
      if (step != kDeath) join_.add(reference);
      command.client_name("standby");
      reference.client_name("standby");
      join_.add(command);
      join_.add(reference);
    }
  };
  add_flight(kDeath + 100);
  EXPECT_EQ(records_.size(), kDeath);  // the pilot's may still come
  join_.give_up();
  ASSERT_GT(records_.size(), kDeath + 1);
  EXPECT_TRUE(records_[kDeath].is_complete());
  EXPECT_EQ(records_[kDeath].command->f_Q_W_n(), make_command(kDeath).f_Q_W_n());
  EXPECT_STREQ(records_[kDeath].reference->client_name().c_str(), "standby");
  EXPECT_STREQ(records_[kDeath + 1].reference->client_name().c_str(), kPilot);
}

TEST_F(StepJoinTest, ANamedClientWithAnotherForceIsNotRecorded) {
  ControlCommand other = make_command(0);
  other.f_Q_W_n()[2] += 1e-12;
  join_.add(make_state(0));
  join_.add(other);
  join_.add(make_reference(0));
  join_.add(make_state(1));
  EXPECT_TRUE(records_.empty());
  join_.give_up();
  ASSERT_GE(records_.size(), 1u);
  EXPECT_EQ(records_[0].command->f_Q_W_n(), make_command(0).f_Q_W_n());
}

TEST_F(StepJoinTest, TheCommandIsTheOneAnsweredAlsoWhereAFaultAppliedAnother) {
  for (std::uint64_t step = 0; step <= 20; ++step) {
    VehicleState state = make_state(step);
    state.f_Q_W_n({1, 2, 3});
    join_.add(state);
    join_.add(make_command(step));
    join_.add(make_reference(step));
  }
  ASSERT_EQ(records_.size(), 20u);
  for (const StepRecord& record : records_) EXPECT_EQ(*record.command, make_command(record.step));
}

// --- answers that were lost ----------------------------------------------------------------------

TEST_F(StepJoinTest, ALostCommandIsRebuiltFromTheNextStateAfterSomePatience) {
  constexpr std::uint64_t kDeath = 5;
  for (std::uint64_t step = 0; step <= kDeath + 1100; ++step) {
    join_.add(make_state(step));
    if (step != kDeath) join_.add(make_command(step));
    join_.add(make_reference(step));
    if (step == kDeath + 900) {
      EXPECT_EQ(records_.size(), kDeath) << "it may still come";
    }
  }
  ASSERT_EQ(records_.size(), kDeath + 1100);
  const StepRecord& record = records_[kDeath];
  EXPECT_EQ(record.origin, AnswerOrigin::kRebuilt);
  EXPECT_EQ(*record.reference, make_reference(kDeath));
  EXPECT_EQ(record.command->step(), kDeath);
  EXPECT_EQ(record.command->run_id(), kRunId);
  EXPECT_EQ(record.command->f_Q_W_n(), make_command(kDeath).f_Q_W_n());
  EXPECT_STREQ(record.command->client_name().c_str(), kPilot);
  EXPECT_EQ(record.command->compute_time_ns(), 0u);
  EXPECT_EQ(record.command->fault(), FAULT_NONE);
  for (const StepRecord& other : records_)
    ASSERT_EQ(other.origin == AnswerOrigin::kRebuilt, other.step == kDeath) << other.step;
}

class LostReferenceTest : public StepJoinTest {
 protected:
  /// A flight that stalls: the references of steps 5 to 7 died with their writer, and the server
  /// has stopped ahead of the recorder.
  void fly_with_lost_references() {
    for (std::uint64_t step = 0; step <= 500; ++step) {
      join_.add(make_state(step));
      join_.add(make_command(step));
      if (step < 5 || step > 7) join_.add(make_reference(step));
    }
  }
  void pass(std::chrono::milliseconds time) {
    for (; time.count() > 0; time -= 100ms) join_.pass_time(100ms);
  }
};

TEST_F(LostReferenceTest, StepsStuckForTenSecondsAreGivenUpTogether) {
  fly_with_lost_references();
  pass(9900ms);
  EXPECT_EQ(records_.size(), 5u);
  pass(200ms);
  ASSERT_EQ(records_.size(), 500u);
  for (std::uint64_t step = 0; step < 500; ++step) {
    EXPECT_EQ(records_[step].reference.has_value(), step < 5 || step > 7) << step;
    EXPECT_EQ(*records_[step].command, make_command(step));
    EXPECT_TRUE(records_[step].is_answer_expected);
  }
}

TEST_F(LostReferenceTest, ItIsSaidWhatAStuckStepWaitsFor) {
  fly_with_lost_references();
  EXPECT_FALSE(join_.describe_stuck(1s));
  pass(1000ms);
  EXPECT_EQ(join_.describe_stuck(1s), "step 5: the reference of 'pilot'");
}

TEST_F(LostReferenceTest, TimeWithoutLaterStatesIsNotWaiting) {
  join_.add(make_state(0));
  join_.add(make_command(0));
  pass(60000ms);  // paused, say
  join_.add(make_state(1));
  pass(9900ms);
  EXPECT_TRUE(records_.empty());
  EXPECT_FALSE(join_.describe_stuck(10s));
  join_.add(make_reference(0));
  expect_whole_up_to(0);
}

// --- steps that nobody answered in time ----------------------------------------------------------

TEST_F(StepJoinTest, AnUnansweredStepsCommandIsMadeFromTheNextState) {
  for (const ForceOrigin origin : {FORCE_HELD, FORCE_FAIL_SAFE}) {
    SCOPED_TRACE(origin);
    records_.clear();
    StepJoin join([this](const StepRecord& record) { records_.push_back(record); });
    join.add(make_state(0));
    join.add(make_command(0));  // came too late to be in force
    const VehicleState next = make_unanswered_state(1, origin);
    join.add(next);
    EXPECT_TRUE(records_.empty()) << "the reference may still come";
    join.add(make_reference(0));
    ASSERT_EQ(records_.size(), 1u);
    const StepRecord& record = records_[0];
    EXPECT_EQ(*record.reference, make_reference(0));
    EXPECT_EQ(record.origin, origin == FORCE_HELD ? AnswerOrigin::kHeld : AnswerOrigin::kFailSafe);
    EXPECT_EQ(record.command->f_Q_W_n(),
              origin == FORCE_HELD ? next.answer_f_Q_W_n() : next.f_Q_W_n());
    EXPECT_EQ(record.command->client_name(), next.controller_name());
    EXPECT_EQ(record.command->step(), 0u);
    EXPECT_EQ(record.command->compute_time_ns(), 0u);
    EXPECT_EQ(join.dropped().other_client, 1u);
  }
}

TEST_F(StepJoinTest, AnUnansweredStepTakesAnyReferenceOrNoneAfterSomePatience) {
  for (std::uint64_t step = 0; step <= 1200; ++step) {
    join_.add(step == 0 ? make_state(0) : make_unanswered_state(step, FORCE_HELD));
    if (step % 2 == 0) join_.add(make_standby_reference(step));
  }
  ASSERT_GT(records_.size(), 100u);
  EXPECT_LT(records_.size(), 300u) << "the rest may still come";
  join_.give_up();
  ASSERT_EQ(records_.size(), 1201u);
  for (std::uint64_t step = 0; step < 1200; ++step) {
    const StepRecord& record = records_[step];
    ASSERT_TRUE(record.state && record.command) << step;
    ASSERT_TRUE(record.is_unanswered());
    ASSERT_EQ(record.reference.has_value(), step % 2 == 0) << step;
  }
}

TEST_F(StepJoinTest, AHeldStepThatKeepsNobodyWaitingIsNotCalledStuck) {
  join_.add(make_state(0));
  join_.add(make_unanswered_state(1, FORCE_FAIL_SAFE));
  join_.pass_time(5s);
  EXPECT_FALSE(join_.describe_stuck(1s));
  EXPECT_TRUE(records_.empty());
  join_.pass_time(5s);
  EXPECT_EQ(records_.size(), 1u);
}

// --- beginning in mid-flight ---------------------------------------------------------------------

TEST_F(StepJoinTest, ALateJoinerBeginsWithItsFirstStateAndNamesTheGap) {
  std::vector<std::pair<std::uint64_t, std::uint64_t>> gaps;
  StepJoin join([this](const StepRecord& record) { records_.push_back(record); }, 100,
                [&](std::uint64_t from, std::uint64_t to) { gaps.emplace_back(from, to); });
  EXPECT_EQ(join.last_step(), 99);
  // Clients' histories may come first, and reach further back.
  constexpr std::uint64_t kFirst = 50000;
  for (std::uint64_t step = kFirst - 500; step <= kFirst + 10; ++step) {
    join.add(make_command(step));
    join.add(make_reference(step));
  }
  EXPECT_TRUE(gaps.empty());
  for (std::uint64_t step = kFirst; step <= kFirst + 10; ++step) join.add(make_state(step));
  EXPECT_EQ(gaps, (std::vector<std::pair<std::uint64_t, std::uint64_t>>{{100, kFirst - 1}}));
  ASSERT_EQ(records_.size(), 10u);
  for (std::uint64_t i = 0; i < 10; ++i) {
    EXPECT_EQ(records_[i].step, kFirst + i);
    EXPECT_TRUE(records_[i].is_complete());
  }
}

TEST_F(StepJoinTest, AHistoryThatReachesBackFurtherThanNeededLeavesNoGap) {
  bool is_gap = false;
  StepJoin join([this](const StepRecord& record) { records_.push_back(record); }, 100,
                [&](std::uint64_t, std::uint64_t) { is_gap = true; });
  for (std::uint64_t step = 40; step <= 120; ++step) {
    join.add(make_command(step));
    join.add(make_reference(step));
    join.add(make_state(step));
  }
  EXPECT_FALSE(is_gap);
  ASSERT_EQ(records_.size(), 20u);
  EXPECT_EQ(records_[0].step, 100u);
}

// --- the end of a failed or lost run -------------------------------------------------------------

TEST_F(StepJoinTest, TheLastStepOfAFailedRunNeedsNoAnswer) {
  add_steps(0, 9);
  join_.add(make_state(10));
  join_.set_end(10, false, kPilot);
  EXPECT_FALSE(join_.has_ended()) << "an answer may still come";
  join_.give_up();
  EXPECT_TRUE(join_.has_ended());
  ASSERT_EQ(records_.size(), 11u);
  EXPECT_TRUE(records_[10].state);
  EXPECT_FALSE(records_[10].command);
  EXPECT_FALSE(records_[10].is_answer_expected);
  EXPECT_TRUE(records_[9].is_complete());
}

TEST_F(StepJoinTest, TheRefusedAnswerThatEndedARunIsRecordedOfWhicheverClient) {
  add_steps(0, 9);
  join_.add(make_state(10));
  ControlCommand faulted = make_standby_command(10);
  faulted.fault(FAULT_FREE_FALL);
  faulted.mission(MISSION_FAILED);
  join_.add(faulted);
  join_.add(make_standby_reference(10));
  join_.set_end(10, false, kPilot);
  EXPECT_TRUE(join_.has_ended());
  ASSERT_EQ(records_.size(), 11u);
  ASSERT_TRUE(records_[10].is_complete());
  EXPECT_EQ(*records_[10].command, faulted);
  EXPECT_EQ(*records_[10].reference, make_standby_reference(10));
}

TEST_F(StepJoinTest, ARunMayEndBeforeTheStateOfItsLastStepWasPublished) {
  add_steps(0, 9);
  join_.add(make_standby_command(9));
  join_.set_end(10, false, kPilot);
  join_.give_up();
  expect_whole_up_to(9);
}

TEST_F(StepJoinTest, GivingUpHandsOnWhatThereIsInOrder) {
  add_steps(0, 20);
  for (std::uint64_t step = 21; step <= 40; ++step) {
    if (step % 3 != 0) join_.add(make_state(step));
    if (step % 4 != 0) join_.add(make_command(step));
    if (step % 5 != 0) join_.add(make_reference(step));
  }
  join_.set_end(40, true, kPilot);
  join_.give_up();
  EXPECT_TRUE(join_.has_ended());
  ASSERT_EQ(records_.size(), 41u);
  for (std::uint64_t step = 0; step <= 40; ++step) {
    EXPECT_EQ(records_[step].step, step);
    EXPECT_TRUE(records_[step].is_answer_expected);
    EXPECT_EQ(records_[step].state.has_value(), step <= 20 || step % 3 != 0) << step;
  }
}

TEST_F(StepJoinTest, OfALostRunTheLastStepsAnswerIsNotExpected) {
  add_steps(0, 10);
  join_.give_up();
  ASSERT_EQ(records_.size(), 11u);
  EXPECT_TRUE(records_[9].is_answer_expected);
  EXPECT_FALSE(records_[10].is_answer_expected) << "nobody knows whose was applied";
  EXPECT_FALSE(records_[10].command);
}

TEST_F(StepJoinTest, OfALostRunAnswersAloneShowNoStep) {
  add_steps(0, 10);
  join_.add(make_command(11));
  join_.add(make_reference(5000));
  join_.give_up();
  EXPECT_EQ(records_.size(), 11u);
  EXPECT_EQ(join_.last_step(), 10);
  EXPECT_EQ(join_.dropped().out_of_range, 2u);
}

// --- samples that make no sense ------------------------------------------------------------------

TEST_F(StepJoinTest, AbsurdStepsTakeNoMemoryAndDisturbNothing) {
  const auto highest = std::numeric_limits<std::uint64_t>::max();
  join_.add(make_state(0));  // the first state tells where the flight is
  for (std::uint64_t step = 0; step <= kLastStep; ++step) {
    for (const std::uint64_t absurd :
         {highest, highest - step, std::uint64_t{1} << 63, std::uint64_t{1} << 32, step + 100000}) {
      ControlCommand command = make_command(0);
      command.step(absurd);
      join_.add(command);
      Reference reference = make_reference(0);
      reference.step(absurd);
      join_.add(reference);
      VehicleState state = make_state(0);
      state.step(absurd);
      join_.add(state);
    }
    add_step(step);
  }
  join_.set_end(kLastStep, true, kPilot);
  expect_whole_up_to(kLastStep);
  EXPECT_EQ(join_.dropped().out_of_range, (kLastStep + 1) * 5 * 3);
}

TEST_F(StepJoinTest, AnswersToStepsThatAreNotYetFlownCostNoStep) {
  for (const std::uint64_t ahead : {1000u, 5000u, 8191u, 8192u, 8193u, 20000u, 50000u, 65535u}) {
    ControlCommand command = make_command(0);
    command.step(ahead);
    join_.add(command);
    Reference reference = make_reference(0);
    reference.step(ahead);
    join_.add(reference);
  }
  EXPECT_TRUE(records_.empty()) << "steps were given up that nobody has flown";
  add_steps(0, kLastStep);
  join_.set_end(kLastStep, true, kPilot);
  expect_whole_up_to(kLastStep);
}

TEST_F(StepJoinTest, ALostStepIsGivenUpBeforeTheRestFillsTheMemory) {
  constexpr std::uint64_t kMany = 20000;
  for (std::uint64_t step = 0; step <= kMany; ++step) {
    if (step != 5) join_.add(make_state(step));
    join_.add(make_command(step));
    join_.add(make_reference(step));
  }
  EXPECT_GT(records_.size(), kMany - 100);  // caught up behind the gap
  EXPECT_FALSE(records_[5].state);
  EXPECT_FALSE(records_[4].command) << "state 5 would have told whose";
  for (std::uint64_t step = 6; step < records_.size(); ++step)
    ASSERT_TRUE(records_[step].is_complete()) << step;
}

TEST_F(StepJoinTest, ManyDifferentAnswersToOneStepAreBounded) {
  join_.add(make_command(0));
  join_.add(make_reference(0));
  for (int i = 0; i < 100000; ++i) {
    ControlCommand command = make_command(0);
    command.client_name("client " + std::to_string(i));
    join_.add(command);
    Reference reference = make_reference(0);
    reference.client_name("client " + std::to_string(i));
    join_.add(reference);
  }
  join_.add(make_state(0));
  EXPECT_GT(join_.dropped().repeated + join_.dropped().out_of_range, 190000u);
  join_.add(make_state(1));
  expect_whole_up_to(0);
}

// --- strangers -----------------------------------------------------------------------------------

bus::PeerId make_peer(std::uint8_t number) {
  bus::PeerId peer;
  peer.bytes[0] = number;
  return peer;
}

TEST_F(StepJoinTest, WhoUsesThePilotsNameNeitherReplacesNorKeepsOutWhatThePilotSent) {
  const bus::PeerId pilot = make_peer(1);
  join_.add(make_state(0));
  // Ahead of time: references and ends of the mission under the pilot's name.
  for (std::uint8_t stranger = 2; stranger < 8; ++stranger)
    for (std::uint64_t step = 1; step <= kLastStep; ++step)
      for (int i = 0; i < 50; ++i) {
        ControlCommand command = make_command(step);
        command.f_Q_W_n({1.0 * i, 0, stranger * 1.0});
        command.mission(MISSION_FINISHED);
        join_.add(command, make_peer(stranger));
        Reference reference = make_reference(step);
        reference.position_m({1e6, 1e6, 1e6});
        join_.add(reference, make_peer(stranger));
      }
  join_.set_end(kLastStep, true, kPilot);
  for (std::uint64_t step = 0; step <= kLastStep; ++step) {
    join_.add(make_state(step));
    join_.add(make_reference(step), pilot);
    join_.add(make_command(step), pilot);
  }
  expect_whole_up_to(kLastStep);
}

TEST_F(StepJoinTest, WhatIsLateOfThePilotIsNotReplacedByWhatAStrangerSays) {
  constexpr std::uint64_t kFirstLate = 5, kLastLate = 7;
  const bus::PeerId pilot = make_peer(1), stranger = make_peer(2);
  for (std::uint64_t step = 0; step <= 1200; ++step) {
    const bool is_late = step >= kFirstLate && step <= kLastLate;
    Reference forged = make_reference(step);
    forged.position_m({1e6, 1e6, 1e6});
    join_.add(forged, stranger);
    join_.add(make_state(step));
    if (!is_late || step == kFirstLate) join_.add(make_command(step), pilot);
    if (!is_late) join_.add(make_reference(step), pilot);
  }
  EXPECT_EQ(records_.size(), kFirstLate) << "the pilot's may still come";
  for (std::uint64_t step = kFirstLate; step <= kLastLate; ++step) {
    join_.add(make_reference(step), pilot);
    join_.add(make_command(step), pilot);
  }
  ASSERT_EQ(records_.size(), 1200u);
  for (const StepRecord& record : records_)
    ASSERT_EQ(*record.reference, make_reference(record.step));
}

// --- property ------------------------------------------------------------------------------------

TEST(StepJoinPropertyTest, AnyOrderAndAnyCopiesGiveTheSameRecording) {
  for (std::uint64_t seed = 0; seed < 30; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937_64 random(seed);
    const std::uint64_t window = 1 + random() % 40;
    struct Timed {
      double time;
      Sample sample;
    };
    std::vector<Timed> samples;
    const auto add_late = [&](std::uint64_t step, const Sample& sample) {
      const double delay =
          static_cast<double>(random() % 1000) / 1000.0 * static_cast<double>(window);
      samples.push_back({static_cast<double>(step) + delay, sample});
    };
    for (std::uint64_t step = 0; step <= kLastStep; ++step) {
      for (std::uint64_t copies = 1 + random() % 3; copies > 0; --copies) {
        add_late(step, make_state(step));
        add_late(step, make_command(step));
        add_late(step, make_reference(step));
      }
      if (random() % 2 == 0) {
        add_late(step, make_standby_command(step));
        add_late(step, make_standby_reference(step));
      }
    }
    std::stable_sort(samples.begin(), samples.end(),
                     [](const Timed& a, const Timed& b) { return a.time < b.time; });
    const std::size_t end_at = random() % samples.size();

    std::vector<StepRecord> records;
    std::int64_t last_step = -1;
    StepJoin join([&](const StepRecord& record) { records.push_back(record); });
    join.add(make_state(0));  // a writer's samples come in order: its first state is the first
    for (std::size_t i = 0; i < samples.size(); ++i) {
      if (i == end_at) join.set_end(kLastStep, true, kPilot);
      std::visit([&](const auto& message) { join.add(message); }, samples[i].sample);
      ASSERT_GE(join.last_step(), last_step);
      last_step = join.last_step();
    }
    ASSERT_TRUE(join.has_ended());
    join.give_up();
    ASSERT_EQ(records.size(), kLastStep + 1);
    for (std::uint64_t step = 0; step <= kLastStep; ++step) {
      ASSERT_EQ(records[step].step, step);
      ASSERT_TRUE(records[step].is_complete());
      ASSERT_EQ(*records[step].state, make_state(step));
      ASSERT_EQ(*records[step].command, make_command(step));
      ASSERT_EQ(*records[step].reference, make_reference(step));
    }
  }
}

}  // namespace
}  // namespace sls::record
