// The acceptance rules of design 6 ("Commands", "Standby"), tested through the interface of the
// gate.
#include "sim_server/core/answers/command_gate.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <set>

namespace sls::sim {

bool operator==(const OfferedAnswer& a, const OfferedAnswer& b) {
  return a.run_id == b.run_id && a.step == b.step && a.client_name == b.client_name &&
         a.answer.f_Q_W == b.answer.f_Q_W && a.answer.error_code == b.answer.error_code;
}

namespace {

using model::ErrorCode;
using model::MissionPhase;

constexpr std::uint64_t kRun = 0xfeed;
constexpr std::uint32_t kVehicle = 3;
constexpr double kForceLimit = 50.0;

bus::PeerId make_peer(std::uint8_t number) {
  bus::PeerId peer;
  peer.bytes.fill(number);
  return peer;
}

const bus::PeerId kStrongPeer = make_peer(9);
const bus::PeerId kWeakPeer = make_peer(5);
const bus::PeerId kWeakestPeer = make_peer(4);
const bus::PeerId kStranger = make_peer(7);
const ReadyClient kStrong = {kStrongPeer, "strong", 10};
const ReadyClient kWeak = {kWeakPeer, "weak", 1};
const ReadyClient kWeakest = {kWeakestPeer, "weakest", 0};

OfferedAnswer make_answer(std::uint64_t step, double force_z = -10.0) {
  OfferedAnswer command;
  command.run_id = kRun;
  command.vehicle_id = kVehicle;
  command.step = step;
  command.answer.f_Q_W = {0.01 * static_cast<double>(step % 1000), 1.0, force_z};
  command.client_name = "named by nobody";
  return command;
}

OfferedAnswer make_faulted(std::uint64_t step, ErrorCode error_code) {
  OfferedAnswer command = make_answer(step);
  command.answer.error_code = error_code;
  command.answer.mission = MissionPhase::kFailed;
  return command;
}

/// Number of rejected commands. Exactly one counter counts each.
std::uint64_t sum_rejections(const SyncCounters& counters) {
  return counters.rejected_not_finite() + counters.rejected_force_limit() +
         counters.rejected_run() + counters.rejected_step() + counters.rejected_vehicle() +
         counters.rejected_client() + counters.rejected_fault();
}
std::uint64_t sum_unapplied(const SyncCounters& counters) {
  return counters.late() + counters.duplicate() + counters.superseded() + sum_rejections(counters);
}

class CommandGateTest : public testing::Test {
 protected:
  CommandGateTest() {
    gate_.set_clients({kStrong});
    gate_.expect(0);
  }

  void set_clients(const std::vector<ReadyClient>& clients) { gate_.set_clients(clients); }

  /// Sets the clients that are there from the start: none of them is new.
  void start_with(const std::vector<ReadyClient>& clients) {
    gate_.set_clients({});
    gate_.set_clients(clients);
  }

  /// Offers `command` from the only ready client. Expects that the gate rejects and counts it.
  Verdict offer_bad(const OfferedAnswer& command) {
    const auto before = sum_rejections(gate_.counters());
    const Verdict verdict = gate_.offer(command, kStrongPeer);
    EXPECT_FALSE(gate_.accepted());
    EXPECT_EQ(sum_rejections(gate_.counters()), before + 1);
    EXPECT_STRNE(to_string(verdict), "");
    return verdict;
  }

  CommandGate gate_{kRun, kVehicle, {kForceLimit}};
};

TEST_F(CommandGateTest, TheAwaitedAnswerOfAReadyClientIsAccepted) {
  const OfferedAnswer answer = make_answer(0);
  EXPECT_EQ(gate_.offer(answer, kStrongPeer), Verdict::kAccepted);
  ASSERT_TRUE(gate_.accepted());
  EXPECT_EQ(*gate_.accepted(), answer);
  EXPECT_EQ(gate_.counters(), SyncCounters());
  EXPECT_EQ(gate_.refusal(), std::nullopt);
}

TEST_F(CommandGateTest, AnAnswerToAStateThatWasNotPublishedYetIsRefused) {
  gate_.expect(4);
  gate_.expect(5);
  OfferedAnswer early = make_answer(5);
  early.is_early = true;
  EXPECT_EQ(offer_bad(early), Verdict::kEarly);
  EXPECT_EQ(gate_.counters().rejected_step(), 1u);
  OfferedAnswer late = make_answer(4);  // a late answer arrives before the next state
  late.is_early = true;
  EXPECT_EQ(gate_.offer(late, kStrongPeer), Verdict::kLate);
  EXPECT_EQ(gate_.offer(make_answer(5), kStrongPeer), Verdict::kAccepted);
}

TEST_F(CommandGateTest, TheRefusedAnswerToTheAwaitedStepIsKept) {
  EXPECT_FALSE(gate_.refused());
  const OfferedAnswer faulted = make_faulted(0, ErrorCode::kFreeFall);
  gate_.offer(faulted, kStrongPeer);
  ASSERT_TRUE(gate_.refused());
  EXPECT_EQ(*gate_.refused(), faulted);
  gate_.expect(1);
  EXPECT_FALSE(gate_.refused());
}

TEST_F(CommandGateTest, ExpectingTheNextStepForgetsTheAcceptedAnswer) {
  gate_.offer(make_answer(0), kStrongPeer);
  gate_.expect(1);
  EXPECT_FALSE(gate_.accepted());
  EXPECT_EQ(gate_.offer(make_answer(1), kStrongPeer), Verdict::kAccepted);
}

TEST_F(CommandGateTest, AForceAtTheLimitIsAcceptedAndJustBeyondRefused) {
  OfferedAnswer beyond = make_answer(0);
  beyond.answer.f_Q_W = {0, 0, -std::nextafter(kForceLimit, 100.0)};
  EXPECT_EQ(offer_bad(beyond), Verdict::kForceLimit);
  gate_.set_clients({});  // the refused client leaves, another one joins
  gate_.set_clients({kWeak});
  OfferedAnswer at_limit = make_answer(0);
  at_limit.answer.f_Q_W = {30.0, 0.0, -40.0};
  EXPECT_EQ(gate_.offer(at_limit, kWeakPeer), Verdict::kAccepted);
}

TEST_F(CommandGateTest, AForceWhoseSquaresOverflowIsBeyondTheLimit) {
  OfferedAnswer command = make_answer(0);
  command.answer.f_Q_W = {1e300, -1e300, 1e300};
  EXPECT_EQ(offer_bad(command), Verdict::kForceLimit);
  EXPECT_EQ(gate_.counters().rejected_force_limit(), 1u);
}

TEST_F(CommandGateTest, AnyNumberThatIsNotFiniteIsRefused) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double infinity = std::numeric_limits<double>::infinity();
  std::uint64_t offered = 0;
  for (const double bad : {nan, infinity, -infinity})
    for (int axis = 0; axis < 3; ++axis) {
      OfferedAnswer force = make_answer(0);
      force.answer.f_Q_W[axis] = bad;
      EXPECT_EQ(offer_bad(force), Verdict::kNotFinite);
      OfferedAnswer memory = make_answer(0);
      memory.answer.memory.numbers.setZero(3);
      memory.answer.memory.numbers[axis] = bad;
      EXPECT_EQ(offer_bad(memory), Verdict::kNotFinite);
      offered += 2;
    }
  EXPECT_EQ(gate_.counters().rejected_not_finite(), offered);
  gate_.expect(1);
  OfferedAnswer memory = make_answer(1);
  memory.answer.memory.numbers.setConstant(1, nan);
  offer_bad(memory);
  EXPECT_EQ(gate_.refusal(),
            "controller 'strong' answered step 1 with a number that is not finite in "
            "controller.numbers");
}

TEST_F(CommandGateTest, AReferenceThatIsNotFiniteIsRefusedAndNamed) {
  const double infinity = std::numeric_limits<double>::infinity();
  for (const double bad : {std::numeric_limits<double>::quiet_NaN(), infinity, -infinity})
    for (int axis = 0; axis < 3; ++axis) {
      std::array<OfferedAnswer, 5> answers;
      answers.fill(make_answer(0));
      answers[0].answer.reference.position[axis] = bad;
      answers[1].answer.reference.velocity[axis] = bad;
      answers[2].answer.reference.acceleration[axis] = bad;
      answers[3].answer.reference.jerk[axis] = bad;
      answers[4].answer.reference.snap[axis] = bad;
      for (const OfferedAnswer& answer : answers) EXPECT_EQ(offer_bad(answer), Verdict::kNotFinite);
    }
  EXPECT_EQ(gate_.refusal(),
            "controller 'strong' answered step 0 with a number that is not finite in reference");
}

TEST_F(CommandGateTest, TheLargestNumbersOfAReferenceAreFinite) {
  OfferedAnswer answer = make_answer(0);
  answer.answer.reference.snap.setConstant(std::numeric_limits<double>::max());
  answer.answer.reference.jerk.setConstant(std::numeric_limits<double>::lowest());
  EXPECT_EQ(gate_.offer(answer, kStrongPeer), Verdict::kAccepted);
}

TEST_F(CommandGateTest, AFaultIsNamedRatherThanItsReference) {
  OfferedAnswer answer = make_faulted(0, ErrorCode::kFreeFall);
  answer.answer.reference.jerk.setConstant(std::numeric_limits<double>::quiet_NaN());
  EXPECT_EQ(offer_bad(answer), Verdict::kErrorCode);
}

TEST_F(CommandGateTest, ACommandOfAnotherRunIsRefusedAndNotCountedAgainstTheClient) {
  OfferedAnswer command = make_answer(0);
  command.run_id = kRun + 1;
  EXPECT_EQ(offer_bad(command), Verdict::kOtherRun);
  EXPECT_EQ(gate_.counters().rejected_run(), 1u);
  EXPECT_EQ(gate_.refusal(), std::nullopt);
}

TEST_F(CommandGateTest, ACommandForAnUnknownVehicleIsRefusedAndNotCountedAgainstTheClient) {
  OfferedAnswer command = make_answer(0);
  command.vehicle_id = kVehicle + 1;
  EXPECT_EQ(offer_bad(command), Verdict::kUnknownVehicle);
  EXPECT_EQ(gate_.counters().rejected_vehicle(), 1u);
  EXPECT_EQ(gate_.refusal(), std::nullopt);
}

TEST_F(CommandGateTest, AStepThatIsNotAwaitedIsRefusedAndNotCountedAgainstTheClient) {
  std::uint64_t offered = 0;
  for (const std::uint64_t step :
       {std::uint64_t{1}, std::uint64_t{1000000}, std::numeric_limits<std::uint64_t>::max()}) {
    EXPECT_EQ(offer_bad(make_answer(step)), Verdict::kWrongStep);
    EXPECT_EQ(gate_.counters().rejected_step(), ++offered);
  }
  EXPECT_EQ(gate_.refusal(), std::nullopt);
}

TEST_F(CommandGateTest, AnAnswerOfAnUnannouncedClientIsRefused) {
  EXPECT_EQ(gate_.offer(make_answer(0), kStranger), Verdict::kUnknownClient);
  EXPECT_FALSE(gate_.accepted());
  EXPECT_EQ(gate_.counters().rejected_client(), 1u);
  EXPECT_EQ(gate_.offer(make_answer(0), kStrongPeer), Verdict::kAccepted);
}

TEST_F(CommandGateTest, NothingThatAnUnannouncedSenderSendsEndsTheFlight) {
  OfferedAnswer not_finite = make_answer(0);
  not_finite.answer.f_Q_W[0] = std::numeric_limits<double>::quiet_NaN();
  OfferedAnswer excessive = make_answer(0);
  excessive.answer.f_Q_W[0] = 1e6;
  const std::vector<OfferedAnswer> bad = {not_finite, excessive,
                                          make_faulted(0, ErrorCode::kFreeFall), make_answer(0),
                                          make_answer(77)};
  for (const OfferedAnswer& command : bad) {
    gate_.offer(command, kStranger);
    EXPECT_EQ(gate_.refusal(), std::nullopt);
    EXPECT_FALSE(gate_.accepted());
  }
  EXPECT_EQ(sum_rejections(gate_.counters()), bad.size());
  EXPECT_EQ(gate_.offer(make_answer(0), kStrongPeer), Verdict::kAccepted);
}

TEST_F(CommandGateTest, ACopyOfAnAcceptedCommandIsCountedDuplicate) {
  gate_.offer(make_answer(0), kStrongPeer);
  OfferedAnswer again = make_answer(0);
  again.answer.compute_time =
      std::chrono::nanoseconds(12345);  // the compute time is not part of the answer
  EXPECT_EQ(gate_.offer(again, kStrongPeer), Verdict::kDuplicate);
  gate_.expect(1);
  EXPECT_EQ(gate_.offer(again, kStrongPeer), Verdict::kDuplicate);
  gate_.offer(make_answer(1), kStrongPeer);
  EXPECT_EQ(gate_.offer(again, kStrongPeer), Verdict::kDuplicate);
  EXPECT_EQ(gate_.counters().duplicate(), 3u);
  EXPECT_EQ(gate_.counters().rejected_step(), 0u);
}

TEST_F(CommandGateTest, AnotherAnswerToAnAnsweredStepIsNoCopy) {
  gate_.offer(make_answer(0, -10.0), kStrongPeer);
  EXPECT_EQ(gate_.offer(make_answer(0, -11.0), kStrongPeer), Verdict::kContradiction);
  gate_.expect(1);
  EXPECT_EQ(gate_.offer(make_answer(0, -11.0), kStrongPeer), Verdict::kContradiction);
  EXPECT_EQ(gate_.counters().rejected_step(), 2u);
  EXPECT_EQ(gate_.counters().duplicate(), 0u);
  EXPECT_EQ(gate_.counters().superseded(), 0u);
}

TEST_F(CommandGateTest, AnotherClientsCopyOfAnAcceptedCommandIsNoDuplicate) {
  gate_.offer(make_answer(0), kStrongPeer);
  gate_.offer(make_answer(0), kStranger);
  gate_.expect(1);
  gate_.offer(make_answer(0), kStranger);
  EXPECT_EQ(gate_.counters().duplicate(), 0u);
  EXPECT_EQ(sum_rejections(gate_.counters()), 2u);
}

TEST_F(CommandGateTest, ACopyFromFarBackIsCountedAndMemoryStaysBounded) {
  for (std::uint64_t step = 0; step < 10000; ++step) {
    gate_.expect(step);
    gate_.offer(make_answer(step), kStrongPeer);
  }
  EXPECT_EQ(gate_.offer(make_answer(9998), kStrongPeer), Verdict::kDuplicate);
  // The gate remembers few steps: an older copy counts as a wrong step.
  EXPECT_EQ(gate_.offer(make_answer(0), kStrongPeer), Verdict::kWrongStep);
}

// A standby that is further away than the remembered steps answers every state too late.
TEST_F(CommandGateTest, OldAnswersOfADistantStandbyAreSupersededWhileAnotherClientFlies) {
  set_clients({kStrong, kWeak});
  for (std::uint64_t step = 0; step < 300; ++step) {
    gate_.expect(step);
    if (step >= 100) {
      EXPECT_EQ(gate_.offer(make_answer(step - 100), kWeakPeer), Verdict::kSuperseded);
    }
    gate_.offer(make_answer(step), kStrongPeer);
  }
  EXPECT_EQ(gate_.counters().superseded(), 200u);
  EXPECT_EQ(sum_rejections(gate_.counters()), 0u);
  gate_.expect(300);
  EXPECT_EQ(gate_.offer(make_answer(100), kStranger), Verdict::kWrongStep);    // not a client
  EXPECT_EQ(gate_.offer(make_answer(100), kStrongPeer), Verdict::kWrongStep);  // the one that flies
  EXPECT_EQ(gate_.offer(make_answer(400), kWeakPeer), Verdict::kWrongStep);    // of the future
  OfferedAnswer bad = make_answer(100);
  bad.answer.f_Q_W = {0.0, 0.0, 300.0};
  EXPECT_EQ(gate_.offer(bad, kWeakPeer), Verdict::kForceLimit);
}

TEST_F(CommandGateTest, OldAnswersOfTheOnlyClientThatAnswersAreWrongSteps) {
  set_clients({kStrong, kWeak});
  for (std::uint64_t step = 0; step < 300; ++step) gate_.expect(step);  // none came in time
  EXPECT_EQ(gate_.offer(make_answer(100), kWeakPeer), Verdict::kWrongStep);
}

// --- refusals ------------------------------------------------------------------------------------

TEST_F(CommandGateTest, ARefusalOfTheOnlyClientNamesCauseClientAndStep) {
  gate_.expect(41);
  OfferedAnswer command = make_answer(41);
  command.answer.f_Q_W[1] = std::numeric_limits<double>::quiet_NaN();
  offer_bad(command);
  ASSERT_TRUE(gate_.refusal());
  EXPECT_NE(gate_.refusal()->find("'strong'"), std::string::npos) << *gate_.refusal();
  EXPECT_NE(gate_.refusal()->find("41"), std::string::npos) << *gate_.refusal();
  EXPECT_NE(gate_.refusal()->find("not finite"), std::string::npos) << *gate_.refusal();
}

TEST_F(CommandGateTest, AnExcessiveForceIsNamedWithItsLimit) {
  OfferedAnswer command = make_answer(0);
  command.answer.f_Q_W = {0, 300.0, -400.0};
  offer_bad(command);
  ASSERT_TRUE(gate_.refusal());
  EXPECT_NE(gate_.refusal()->find("500 N > 50 N"), std::string::npos) << *gate_.refusal();
  EXPECT_NE(gate_.refusal()->find("force_limit_n"), std::string::npos) << *gate_.refusal();
}

TEST_F(CommandGateTest, AFaultOfTheOnlyClientIsNamed) {
  for (const auto& [fault, name] :
       {std::pair{ErrorCode::kFreeFall, "free_fall"}, std::pair{ErrorCode::kRodLevel, "rod_level"},
        std::pair{ErrorCode::kNotFinite, "not_finite"},
        std::pair{ErrorCode::kStageTimeout, "stage_timeout"}}) {
    CommandGate gate(kRun, kVehicle, {kForceLimit});
    gate.set_clients({kStrong});
    gate.expect(2);
    EXPECT_EQ(gate.offer(make_faulted(2, fault), kStrongPeer), Verdict::kErrorCode);
    EXPECT_EQ(gate.counters().rejected_fault(), 1u);
    ASSERT_TRUE(gate.refusal());
    EXPECT_NE(gate.refusal()->find(name), std::string::npos) << *gate.refusal();
    EXPECT_NE(gate.refusal()->find("'strong'"), std::string::npos) << *gate.refusal();
  }
}

TEST_F(CommandGateTest, AFailedMissionWithoutAFaultIsRefusedToo) {
  EXPECT_EQ(offer_bad(make_faulted(0, ErrorCode::kNone)), Verdict::kErrorCode);
  ASSERT_TRUE(gate_.refusal());
  EXPECT_EQ(gate_.refusal()->find("none"), std::string::npos) << *gate_.refusal();
}

/// A gate of a mission of two stages that cannot be over before step 500, which awaits `step`.
class MissionGateTest : public testing::Test {
 protected:
  Verdict offer(std::uint64_t step, std::uint32_t stage, MissionPhase mission,
                ErrorCode error_code = ErrorCode::kNone) {
    gate_.emplace(kRun, kVehicle, AnswerLimits{kForceLimit, 2, 500});
    gate_->set_clients({kStrong});
    gate_->expect(step);
    OfferedAnswer answer = make_answer(step);
    answer.answer.memory.stage = stage;
    answer.answer.mission = mission;
    answer.answer.error_code = error_code;
    return gate_->offer(answer, kStrongPeer);
  }
  std::string refusal() const {
    EXPECT_EQ(gate_->counters().rejected_fault(), 1u);
    return gate_->refusal().value_or("none");
  }

  std::optional<CommandGate> gate_;
};

TEST_F(MissionGateTest, AStageBeyondTheMissionIsRefused) {
  EXPECT_EQ(offer(600, 4'000'000'000, MissionPhase::kRunning), Verdict::kUnknownStage);
  EXPECT_EQ(refusal(),
            "controller 'strong' answered step 600 with a stage beyond its mission: stage_index "
            "4000000000 > 2");
  EXPECT_EQ(offer(600, 3, MissionPhase::kFinished), Verdict::kUnknownStage);
  EXPECT_EQ(offer(600, 2, MissionPhase::kFinished), Verdict::kAccepted);
  EXPECT_EQ(offer(600, 2, MissionPhase::kRunning), Verdict::kAccepted)
      << "reported by ParticipantCheck";
  EXPECT_EQ(offer(0, 1, MissionPhase::kRunning), Verdict::kAccepted)
      << "as if the first stage were over";
}

TEST_F(MissionGateTest, AnEndBeforeTheEarliestStepIsRefused) {
  EXPECT_EQ(offer(499, 1, MissionPhase::kFinished), Verdict::kEarlyEnd);
  EXPECT_EQ(refusal(),
            "controller 'strong' answered step 499 with an early end of its mission: expected at "
            "step 500 or later");
  EXPECT_EQ(offer(499, 2, MissionPhase::kRunning), Verdict::kEarlyEnd)
      << "the next client would finish";
  EXPECT_EQ(offer(500, 1, MissionPhase::kFinished), Verdict::kAccepted);
  EXPECT_EQ(offer(500, 2, MissionPhase::kFinished), Verdict::kAccepted);
}

TEST_F(MissionGateTest, ValuesThatTheContractDoesNotDefineAreRefused) {
  EXPECT_EQ(offer(600, 1, static_cast<MissionPhase>(7)), Verdict::kUndefined);
  EXPECT_EQ(refusal(), "controller 'strong' answered step 600 with an undefined value: mission 7");
  EXPECT_EQ(offer(600, 1, MissionPhase::kFailed, static_cast<ErrorCode>(5)), Verdict::kUndefined);
  EXPECT_EQ(refusal(), "controller 'strong' answered step 600 with an undefined value: fault 5");
  EXPECT_EQ(offer(600, 1, static_cast<MissionPhase>(0xffffffffU)), Verdict::kUndefined);
}

TEST_F(CommandGateTest, AFaultInAnswerToAnotherStepEndsNothing) {
  EXPECT_EQ(gate_.offer(make_faulted(1, ErrorCode::kFreeFall), kStrongPeer), Verdict::kErrorCode);
  EXPECT_EQ(gate_.refusal(), std::nullopt);
  EXPECT_EQ(gate_.offer(make_answer(0), kStrongPeer), Verdict::kAccepted);
}

TEST_F(CommandGateTest, ARefusalDoesNotOutliveItsStep) {
  gate_.set_clients({kStrong, kWeak});
  gate_.offer(make_faulted(0, ErrorCode::kRodLevel), kStrongPeer);
  EXPECT_EQ(gate_.offer(make_answer(0), kWeakPeer), Verdict::kAccepted);
  gate_.expect(1);
  EXPECT_EQ(gate_.offer(make_answer(1), kStrongPeer), Verdict::kAccepted);
}

TEST_F(CommandGateTest, NoRefusalWhileAnotherReadyClientCanAnswer) {
  set_clients({kStrong, kWeak});
  gate_.offer(make_faulted(0, ErrorCode::kRodLevel), kStrongPeer);
  EXPECT_EQ(gate_.refusal(), std::nullopt);
  ASSERT_TRUE(gate_.awaited_client());
  EXPECT_EQ(gate_.awaited_client()->name, "weak");
  gate_.offer(make_faulted(0, ErrorCode::kFreeFall), kWeakPeer);
  ASSERT_TRUE(gate_.refusal());
  EXPECT_NE(gate_.refusal()->find("answered step 0"), std::string::npos);
}

TEST_F(CommandGateTest, ARefusalIsKnownWhileASilentStandbyIsAwaited) {
  set_clients({kStrong, kWeak});
  OfferedAnswer beyond = make_answer(0);
  beyond.answer.f_Q_W = {0, 0, -60.0};
  gate_.offer(beyond, kStrongPeer);
  for (const char* words : {"'strong' answered step 0", "force_limit_n: 60 N > 50 N"})
    EXPECT_NE(gate_.describe_refusals().find(words), std::string::npos)
        << gate_.describe_refusals();
  gate_.expect(1);
  EXPECT_NE(gate_.describe_refusals().find("'strong' answered step 0"), std::string::npos)
      << "nobody has answered since";
  EXPECT_EQ(gate_.awaited_client()->name, "strong") << "its answer to this step may be valid";
  gate_.offer(make_answer(1), kStrongPeer);
  EXPECT_EQ(gate_.describe_refusals(), "");
}

TEST_F(CommandGateTest, ALateAnswerThatIsRefusedIsKnownUntilItsClientGivesAValidOne) {
  gate_.expect(1);
  gate_.offer(make_faulted(0, ErrorCode::kRodLevel), kStrongPeer);
  EXPECT_NE(gate_.describe_refusals().find("rod_level"), std::string::npos);
  EXPECT_EQ(gate_.refusal(), std::nullopt) << "the awaited step may still get its answer";
  gate_.expect(2);
  gate_.offer(make_answer(1), kStrongPeer);
  EXPECT_EQ(gate_.describe_refusals(), "");
}

TEST_F(CommandGateTest, TheRefusedClientsStandbyLeavingEndsTheWait) {
  set_clients({kStrong, kWeak});
  gate_.offer(make_faulted(0, ErrorCode::kRodLevel), kStrongPeer);
  EXPECT_EQ(gate_.refusal(), std::nullopt);
  set_clients({kStrong});
  ASSERT_TRUE(gate_.refusal());
  EXPECT_NE(gate_.refusal()->find("rod_level"), std::string::npos) << *gate_.refusal();
}

TEST_F(CommandGateTest, TheAnswerAStandbyHasGivenIsTakenWhenTheStrongerOneIsRefused) {
  set_clients({kStrong, kWeak});
  EXPECT_EQ(gate_.offer(make_answer(0), kWeakPeer), Verdict::kHeld);
  EXPECT_FALSE(gate_.accepted());
  EXPECT_EQ(gate_.offer(make_faulted(0, ErrorCode::kFreeFall), kStrongPeer), Verdict::kErrorCode);
  ASSERT_TRUE(gate_.accepted());
  EXPECT_EQ(*gate_.accepted(), make_answer(0));
  EXPECT_EQ(gate_.refusal(), std::nullopt);
}

TEST_F(CommandGateTest, AfterARefusedAnswerToAStepTheClientIsNotAwaitedThere) {
  set_clients({kStrong, kWeak});
  gate_.offer(make_faulted(0, ErrorCode::kFreeFall), kStrongPeer);
  const std::string first = gate_.describe_refusals();
  EXPECT_NE(first.find("free_fall"), std::string::npos) << first;
  gate_.offer(make_faulted(0, ErrorCode::kRodLevel), kStrongPeer);
  EXPECT_EQ(gate_.describe_refusals(), first) << "the first one counts";
  EXPECT_EQ(gate_.offer(make_answer(0), kStrongPeer), Verdict::kHeld) << "also before a valid one";
  EXPECT_EQ(gate_.awaited_client()->name, "weak");
  EXPECT_EQ(gate_.offer(make_answer(0), kWeakPeer), Verdict::kAccepted);
  set_clients({kStrong, {kWeakPeer, "weak", 1, true}});
  EXPECT_EQ(gate_.refusal(), std::nullopt) << "the step has its answer";
  gate_.expect(1);
  gate_.offer(make_faulted(0, ErrorCode::kFreeFall), kStrongPeer);
  EXPECT_EQ(gate_.describe_refusals(), "") << "the step before had its answer, too";
}

TEST_F(CommandGateTest, ABadCommandAfterAClientsValidAnswerIsOnlyCounted) {
  set_clients({kStrong, kWeak});
  gate_.offer(make_answer(0), kWeakPeer);
  EXPECT_EQ(gate_.offer(make_faulted(0, ErrorCode::kFreeFall), kWeakPeer), Verdict::kErrorCode);
  gate_.offer(make_faulted(0, ErrorCode::kFreeFall), kStrongPeer);
  ASSERT_TRUE(gate_.accepted()) << "the standby's valid answer was there first";
  EXPECT_EQ(gate_.refusal(), std::nullopt);
}

// --- several clients -----------------------------------------------------------------------------

TEST_F(CommandGateTest, TheStrongestClientFliesAlsoWhenAnotherAnswersFirst) {
  set_clients({kWeakest, kStrong, kWeak});
  EXPECT_EQ(gate_.offer(make_answer(0, -1.0), kWeakestPeer), Verdict::kHeld);
  EXPECT_EQ(gate_.offer(make_answer(0, -2.0), kWeakPeer), Verdict::kHeld);
  EXPECT_EQ(gate_.offer(make_answer(0, -3.0), kStrongPeer), Verdict::kAccepted);
  EXPECT_EQ(*gate_.accepted(), make_answer(0, -3.0));
  EXPECT_EQ(gate_.counters().superseded(), 2u);
}

TEST_F(CommandGateTest, AWeakerClientsLateAnswerIsSuperseded) {
  set_clients({kStrong, kWeak});
  gate_.offer(make_answer(0), kStrongPeer);
  EXPECT_EQ(gate_.offer(make_answer(0), kWeakPeer), Verdict::kSuperseded);
  gate_.expect(1);
  EXPECT_EQ(gate_.offer(make_answer(0), kWeakPeer), Verdict::kSuperseded);
  EXPECT_EQ(gate_.counters().superseded(), 2u);
  EXPECT_EQ(sum_rejections(gate_.counters()), 0u);
}

TEST_F(CommandGateTest, CopiesOfAHeldAnswerAreCounted) {
  set_clients({kStrong, kWeak});
  for (int i = 0; i < 4; ++i) gate_.offer(make_answer(0), kWeakPeer);
  gate_.offer(make_answer(0), kStrongPeer);
  EXPECT_EQ(sum_unapplied(gate_.counters()), 4u);
  EXPECT_EQ(sum_rejections(gate_.counters()), 0u);
}

TEST_F(CommandGateTest, EqualStrengthsAreOrderedByNameNotByArrival) {
  const ReadyClient alpha = {make_peer(200), "alpha", 5};
  const ReadyClient beta = {make_peer(1), "beta", 5};
  for (const auto& clients : {std::vector{alpha, beta}, std::vector{beta, alpha}}) {
    CommandGate gate(kRun, kVehicle, {kForceLimit});
    gate.set_clients(clients);
    gate.expect(0);
    EXPECT_EQ(gate.awaited_client()->name, "alpha");
    EXPECT_EQ(gate.offer(make_answer(0, -2.0), beta.peer), Verdict::kHeld);
    EXPECT_EQ(gate.offer(make_answer(0, -1.0), alpha.peer), Verdict::kAccepted);
  }
}

TEST_F(CommandGateTest, EqualStrengthsAndNamesAreStillOrdered) {
  const ReadyClient first = {make_peer(1), "same", 5};
  const ReadyClient second = {make_peer(2), "same", 5};
  std::set<bus::PeerId> chosen;
  for (const auto& clients : {std::vector{first, second}, std::vector{second, first}}) {
    CommandGate gate(kRun, kVehicle, {kForceLimit});
    gate.set_clients(clients);
    gate.expect(0);
    chosen.insert(gate.awaited_client()->peer);
  }
  EXPECT_EQ(chosen.size(), 1u);
}

TEST_F(CommandGateTest, StrengthDecidesOverTheWholeRangeOfItsType) {
  const ReadyClient lowest = {make_peer(1), "a", std::numeric_limits<std::int32_t>::min()};
  const ReadyClient highest = {make_peer(2), "b", std::numeric_limits<std::int32_t>::max()};
  set_clients({lowest, highest});
  EXPECT_EQ(gate_.awaited_client()->name, "b");
}

TEST_F(CommandGateTest, TheStandbysHeldAnswerFliesWhenTheStrongestIsSilent) {
  set_clients({kStrong, kWeak});
  gate_.offer(make_answer(0, -2.0), kWeakPeer);
  EXPECT_TRUE(gate_.pass_over_silent_client());
  ASSERT_TRUE(gate_.accepted());
  EXPECT_EQ(*gate_.accepted(), make_answer(0, -2.0));
  EXPECT_EQ(gate_.counters().take_overs(), 1u);
  EXPECT_EQ(gate_.counters().superseded(), 0u);
}

TEST_F(CommandGateTest, TheNextClientIsAwaitedWhenTheStrongestIsSilent) {
  start_with({kStrong, kWeak, kWeakest});
  EXPECT_TRUE(gate_.pass_over_silent_client());
  EXPECT_EQ(gate_.awaited_client()->name, "weak");
  EXPECT_FALSE(gate_.accepted());
  EXPECT_TRUE(gate_.pass_over_silent_client());
  EXPECT_EQ(gate_.awaited_client()->name, "weakest");
  EXPECT_EQ(gate_.counters().take_overs(), 0u) << "nobody has taken over yet";
  EXPECT_EQ(gate_.offer(make_answer(0), kWeakestPeer), Verdict::kAccepted);
  EXPECT_EQ(gate_.counters().take_overs(), 1u);
  ASSERT_TRUE(gate_.take_over());
  EXPECT_EQ(gate_.take_over()->from, "strong");
  EXPECT_EQ(gate_.take_over()->to, "weakest");
}

TEST_F(CommandGateTest, WithoutAnotherClientThereIsNoTakeOver) {
  EXPECT_FALSE(gate_.pass_over_silent_client());
  EXPECT_EQ(gate_.counters().take_overs(), 0u);
  EXPECT_EQ(gate_.awaited_client()->name, "strong");
  EXPECT_EQ(gate_.refusal(), std::nullopt);
}

TEST_F(CommandGateTest, ARefusedClientDoesNotTakeOver) {
  set_clients({kStrong, kWeak});
  gate_.offer(make_faulted(0, ErrorCode::kFreeFall), kWeakPeer);
  EXPECT_FALSE(gate_.pass_over_silent_client());
  EXPECT_EQ(gate_.awaited_client()->name, "strong");
}

TEST_F(CommandGateTest, NothingIsPassedOverOnceAnAnswerIsAccepted) {
  set_clients({kStrong, kWeak});
  gate_.offer(make_answer(0), kStrongPeer);
  EXPECT_FALSE(gate_.pass_over_silent_client());
  EXPECT_EQ(gate_.counters().take_overs(), 0u);
}

TEST_F(CommandGateTest, TheSilentClientIsSkippedUntilItAnswersAnAwaitedStep) {
  start_with({kStrong, kWeak});
  gate_.pass_over_silent_client();
  gate_.offer(make_answer(0), kWeakPeer);
  gate_.expect(1);
  EXPECT_EQ(gate_.awaited_client()->name, "weak") << "no second wait for the silent one";
  EXPECT_EQ(gate_.offer(make_answer(0), kStrongPeer), Verdict::kSuperseded);
  EXPECT_EQ(gate_.awaited_client()->name, "weak") << "step 0 is not awaited any more";
  EXPECT_EQ(gate_.offer(make_answer(1), kStrongPeer), Verdict::kAccepted);
  ASSERT_TRUE(gate_.take_over());
  EXPECT_EQ(gate_.take_over()->from, "weak");
  EXPECT_EQ(gate_.take_over()->to, "strong");
  gate_.expect(2);
  EXPECT_EQ(gate_.awaited_client()->name, "strong");
  EXPECT_EQ(gate_.counters().take_overs(), 2u) << "there and back";
  EXPECT_FALSE(gate_.take_over());
}

TEST_F(CommandGateTest, TheStrongestIsAwaitedAgainAlsoIfItsAnswerCameSecond) {
  start_with({kStrong, kWeak});
  gate_.pass_over_silent_client();
  gate_.offer(make_answer(0), kWeakPeer);
  EXPECT_EQ(gate_.offer(make_answer(0), kStrongPeer), Verdict::kSuperseded);
  gate_.expect(1);
  EXPECT_EQ(gate_.awaited_client()->name, "strong");
}

TEST_F(CommandGateTest, TheFirstAnswerToAStepThatWentByIsLateAndTheOthersAreNot) {
  set_clients({kStrong, kWeak});
  gate_.expect(1);
  gate_.expect(2);
  EXPECT_EQ(gate_.offer(make_answer(0), kStrongPeer), Verdict::kLate);
  EXPECT_EQ(gate_.offer(make_answer(0), kStrongPeer), Verdict::kDuplicate);
  EXPECT_EQ(gate_.offer(make_answer(0), kWeakPeer), Verdict::kSuperseded);
  EXPECT_EQ(gate_.offer(make_answer(1), make_peer(99)), Verdict::kWrongStep) << "a stranger";
  EXPECT_EQ(gate_.offer(make_answer(1), kWeakPeer), Verdict::kLate);
  EXPECT_FALSE(gate_.accepted());
}

TEST_F(CommandGateTest, MissesAreCountedInARowAndForgottenWithAnAnswer) {
  set_clients({kStrong});
  EXPECT_EQ(gate_.count_miss(), 1);
  gate_.expect(1);
  EXPECT_EQ(gate_.count_miss(), 2);
  gate_.expect(2);
  gate_.offer(make_answer(2), kStrongPeer);
  gate_.expect(3);
  EXPECT_EQ(gate_.count_miss(), 1);
  set_clients({});
  EXPECT_EQ(gate_.count_miss(), 0) << "nobody is awaited";
}

TEST_F(CommandGateTest, WhenAllAreSilentAnyOfThemMayComeBack) {
  for (const auto& back : {kStrong, kWeak, kWeakest}) {
    CommandGate gate(kRun, kVehicle, {kForceLimit});
    gate.set_clients({kStrong, kWeak, kWeakest});
    gate.expect(0);
    while (gate.pass_over_silent_client()) {
    }
    EXPECT_EQ(gate.offer(make_answer(0), back.peer), Verdict::kAccepted) << back.name;
  }
}

TEST_F(CommandGateTest, AStrongerClientThatJoinsFliesAfterItsFirstAnswer) {
  set_clients({kWeak});
  gate_.offer(make_answer(0), kWeakPeer);
  gate_.expect(1);
  set_clients({kWeak, kStrong});
  EXPECT_EQ(gate_.offer(make_answer(1), kWeakPeer), Verdict::kAccepted) << "it may not see step 1";
  EXPECT_EQ(gate_.offer(make_answer(1), kStrongPeer), Verdict::kSuperseded);
  gate_.expect(2);
  EXPECT_EQ(gate_.offer(make_answer(2), kWeakPeer), Verdict::kHeld);
  EXPECT_EQ(gate_.offer(make_answer(2), kStrongPeer), Verdict::kAccepted);
}

TEST_F(CommandGateTest, ADistantClientThatJoinsMayAnswerAnEarlierStepFirst) {
  set_clients({kWeak});
  for (std::uint64_t step : {0, 1}) {
    gate_.offer(make_answer(step), kWeakPeer);
    gate_.expect(step + 1);
  }
  set_clients({kWeak, kStrong});
  EXPECT_EQ(gate_.offer(make_answer(1), kStrongPeer), Verdict::kSuperseded);
  EXPECT_EQ(gate_.awaited_client()->name, "strong");
}

TEST_F(CommandGateTest, AClientThatJoinsAloneIsAwaitedAtOnce) {
  set_clients({kStrong});
  gate_.offer(make_answer(0), kStrongPeer);
  gate_.expect(1);
  set_clients({});
  set_clients({kWeak});
  EXPECT_EQ(gate_.awaited_client()->name, "weak");
  EXPECT_EQ(gate_.offer(make_answer(1), kWeakPeer), Verdict::kAccepted);
}

TEST_F(CommandGateTest, AHeldAnswerFliesWhenTheStrongerClientLeaves) {
  set_clients({kStrong, kWeak});
  gate_.offer(make_answer(0, -2.0), kWeakPeer);
  set_clients({kWeak});
  ASSERT_TRUE(gate_.accepted());
  EXPECT_EQ(*gate_.accepted(), make_answer(0, -2.0));
}

TEST_F(CommandGateTest, AnswersOfAClientThatLeftAreCounted) {
  set_clients({kStrong, kWeak});
  gate_.offer(make_answer(0), kWeakPeer);
  set_clients({kStrong});
  gate_.offer(make_answer(0), kStrongPeer);
  EXPECT_EQ(gate_.counters().superseded(), 1u);
}

TEST_F(CommandGateTest, SilenceAndRefusalsOutliveANewRosterAndARestartedClientBeginsAfresh) {
  start_with({kStrong, kWeak});
  gate_.pass_over_silent_client();
  set_clients({kWeak, kStrong});
  EXPECT_EQ(gate_.awaited_client()->name, "weak");
  ReadyClient restarted = kStrong;
  restarted.peer = make_peer(88);  // a new process is a new participant
  set_clients({kWeak, restarted});
  EXPECT_EQ(gate_.awaited_client()->name, "weak");
  EXPECT_EQ(gate_.offer(make_answer(0), restarted.peer), Verdict::kAccepted);
}

TEST_F(CommandGateTest, WithoutClientsNothingIsAwaitedAndNothingRefused) {
  set_clients({});
  EXPECT_EQ(gate_.awaited_client(), std::nullopt);
  EXPECT_EQ(gate_.refusal(), std::nullopt);
  EXPECT_FALSE(gate_.pass_over_silent_client());
  EXPECT_EQ(gate_.offer(make_answer(0), kStrongPeer), Verdict::kUnknownClient);
}

TEST_F(CommandGateTest, EveryRejectionHasAReason) {
  std::set<std::string> texts;
  for (const Verdict verdict :
       {Verdict::kNotFinite, Verdict::kForceLimit, Verdict::kOtherRun, Verdict::kEarly,
        Verdict::kWrongStep, Verdict::kContradiction, Verdict::kUnknownVehicle,
        Verdict::kUnknownClient, Verdict::kUndefined, Verdict::kErrorCode, Verdict::kUnknownStage,
        Verdict::kEarlyEnd})
    texts.insert(to_string(verdict));
  EXPECT_EQ(texts.size(), 12u);
  EXPECT_EQ(texts.count(""), 0u);
  for (const Verdict verdict :
       {Verdict::kAccepted, Verdict::kHeld, Verdict::kDuplicate, Verdict::kSuperseded})
    EXPECT_STREQ(to_string(verdict), "");
}

// --- properties ----------------------------------------------------------------------------------

/// Invalid commands of every kind, which the gate must never accept.
class Junk {
 public:
  explicit Junk(std::mt19937_64& random) : random_(random) {}

  /// One kind is for another step, the others are for the awaited step.
  OfferedAnswer make(std::uint64_t awaited) {
    OfferedAnswer command = make_answer(awaited, -static_cast<double>(pick(40)));
    switch (pick(7)) {
      case 0:
        command.answer.f_Q_W[static_cast<int>(pick(3))] = std::numeric_limits<double>::quiet_NaN();
        break;
      case 1:
        command.answer.memory.numbers =
            Eigen::Vector2d(1.0, -std::numeric_limits<double>::infinity());
        break;
      case 2:
        command.answer.f_Q_W[static_cast<int>(pick(3))] =
            kForceLimit * 1.001 + static_cast<double>(pick(1000));
        break;
      case 3:
        command.run_id = random_();
        break;
      case 4:
        command.vehicle_id = kVehicle + 1 + static_cast<std::uint32_t>(pick(100));
        break;
      case 5:
        command.answer.error_code = static_cast<ErrorCode>(1 + pick(7));
        break;
      default:
        // Another step: far ahead, far behind, or just missed.
        command.step = pick(2) == 0 ? random_() | (1ull << 40) : awaited + 1 + pick(3);
    }
    return command;
  }

  std::uint64_t pick(std::uint64_t count) { return random_() % count; }

 private:
  std::mt19937_64& random_;
};

TEST(CommandGatePropertyTest, InvalidAnswersChangeNoForceAndAreCounted) {
  for (std::uint64_t seed = 0; seed < 40; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937_64 random(seed);
    Junk junk(random);
    const std::vector<ReadyClient> clients = {kWeak, kStrong, kWeakest};
    CommandGate gate(kRun, kVehicle, {kForceLimit});
    gate.set_clients(clients);
    std::uint64_t offered = 0, accepted = 0;
    constexpr std::uint64_t kSteps = 150;
    for (std::uint64_t step = 0; step < kSteps; ++step) {
      gate.expect(step);
      const OfferedAnswer strong_answer = make_answer(step, -10.0 - static_cast<double>(seed));
      struct Offer {
        OfferedAnswer command;
        bus::PeerId sender;
      };
      // Before the strongest client's answer, in any order: invalid commands of strangers, and
      // those of clients with another step, run or vehicle. After it, the clients' other invalid
      // commands.
      std::vector<Offer> before, after;
      for (std::uint64_t i = junk.pick(6); i > 0; --i) {
        before.push_back({junk.make(step), kStranger});
        const auto command = junk.make(step);
        const auto sender = clients[junk.pick(3)].peer;
        (command.step == step && command.run_id == kRun && command.vehicle_id == kVehicle ? after
                                                                                          : before)
            .push_back({command, sender});
      }
      for (std::uint64_t i = junk.pick(3); i > 0; --i) {
        before.push_back({make_answer(step, -7.0), kStranger});
        before.push_back({make_answer(step, -3.0), kWeakPeer});
        after.push_back({make_answer(step, -2.0), kWeakestPeer});
        after.push_back({strong_answer, kStrongPeer});
        if (step > 0) before.push_back({make_answer(step - 1, -3.0), kWeakPeer});
      }
      std::shuffle(before.begin(), before.end(), random);
      std::shuffle(after.begin(), after.end(), random);
      for (const Offer& offer : before) gate.offer(offer.command, offer.sender);
      ASSERT_FALSE(gate.accepted());
      ASSERT_EQ(gate.refusal(), std::nullopt);
      ASSERT_EQ(gate.offer(strong_answer, kStrongPeer), Verdict::kAccepted);
      for (const Offer& offer : after) gate.offer(offer.command, offer.sender);
      ASSERT_TRUE(gate.accepted());
      ASSERT_EQ(*gate.accepted(), strong_answer);
      offered += before.size() + 1 + after.size();
      ++accepted;
      ASSERT_EQ(offered, accepted + sum_unapplied(gate.counters())) << "step " << step;
    }
    EXPECT_EQ(accepted, kSteps);
    EXPECT_EQ(gate.counters().take_overs(), 0u);
  }
}

TEST(CommandGatePropertyTest, EveryStepIsAnsweredAsLongAsOneOfTheChangingClientsLives) {
  const std::vector<ReadyClient> everybody = {kStrong, kWeak, kWeakest};
  for (std::uint64_t seed = 0; seed < 40; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937_64 random(seed);
    CommandGate gate(kRun, kVehicle, {kForceLimit});
    gate.set_clients(everybody);
    std::uint64_t offered = 0;
    for (std::uint64_t step = 0; step < 200; ++step) {
      gate.expect(step);
      // Some announced clients are dead, some clients are not announced. At least one answers.
      std::vector<ReadyClient> announced, alive;
      while (alive.empty()) {
        announced.clear();
        for (const ReadyClient& client : everybody) {
          if (random() % 8 == 0) continue;
          announced.push_back(client);
          if (random() % 3 != 0) alive.push_back(client);
        }
      }
      gate.set_clients(announced);
      std::shuffle(alive.begin(), alive.end(), random);
      for (const ReadyClient& client : alive) {
        gate.offer(make_answer(step, -static_cast<double>(client.strength)), client.peer);
        ++offered;
      }
      while (!gate.accepted()) ASSERT_TRUE(gate.pass_over_silent_client()) << "step " << step;
      const bool is_of_the_living =
          std::any_of(alive.begin(), alive.end(), [&](const ReadyClient& client) {
            return *gate.accepted() == make_answer(step, -static_cast<double>(client.strength));
          });
      ASSERT_TRUE(is_of_the_living);
      ASSERT_EQ(offered, step + 1 + sum_unapplied(gate.counters())) << "step " << step;
    }
  }
}

// --- gone ----------------------------------------------------------------------------------------

ReadyClient make_gone(ReadyClient client) {
  client.is_gone = true;
  return client;
}

TEST_F(CommandGateTest, AClientThatIsGoneIsAwaitedOnlyIfNoOtherIsThere) {
  set_clients({make_gone(kStrong), kWeak});
  EXPECT_EQ(gate_.awaited_client()->name, "weak");
  EXPECT_EQ(gate_.offer(make_answer(0), kWeakPeer), Verdict::kAccepted);
  set_clients({make_gone(kStrong)});
  EXPECT_EQ(gate_.awaited_client()->name, "strong");
  EXPECT_TRUE(gate_.awaited_client()->is_gone);
}

TEST_F(CommandGateTest, AHeldAnswerIsTakenWhenTheAwaitedClientIsGone) {
  set_clients({kStrong, kWeak});
  EXPECT_EQ(gate_.offer(make_answer(0), kWeakPeer), Verdict::kHeld);
  set_clients({make_gone(kStrong), kWeak});
  EXPECT_TRUE(gate_.accepted());
}

TEST_F(CommandGateTest, OneThatIsGoneDoesNotTakeOver) {
  set_clients({kStrong, make_gone(kWeak)});
  EXPECT_FALSE(gate_.pass_over_silent_client());
}

TEST_F(CommandGateTest, ASilentClientIsAwaitedRatherThanOneThatIsGone) {
  start_with({kStrong, kWeak});
  EXPECT_TRUE(gate_.pass_over_silent_client());
  EXPECT_FALSE(gate_.pass_over_silent_client());
  set_clients({make_gone(kStrong), kWeak});
  EXPECT_EQ(gate_.awaited_client()->name, "weak");
}

TEST_F(CommandGateTest, AnAnswerBringsAClientBackThatWasGone) {
  set_clients({make_gone(kStrong), kWeak});
  EXPECT_EQ(gate_.offer(make_answer(0), kStrongPeer), Verdict::kAccepted);
  EXPECT_FALSE(gate_.awaited_client()->is_gone);
}

TEST_F(CommandGateTest, ARefusalEndsTheRunAtOnceIfAllOthersAreGone) {
  set_clients({make_gone(kStrong), kWeak});
  gate_.offer(make_faulted(0, ErrorCode::kFreeFall), kWeakPeer);
  ASSERT_TRUE(gate_.refusal());
  EXPECT_NE(gate_.refusal()->find("'weak'"), std::string::npos) << *gate_.refusal();
  set_clients({make_gone(kStrong)});
  EXPECT_FALSE(gate_.refusal()) << "it may come back";
}

TEST_F(CommandGateTest, ItCountsTheAnswersOfEachClientAndKnowsWhichAreMissing) {
  const auto find = [](const CommandGate& gate, const bus::PeerId& sought) {
    std::pair<std::uint64_t, bool> found;
    gate.for_each_client([&](const bus::PeerId& peer, std::uint64_t answers, bool is_missing) {
      if (peer == sought) found = {answers, is_missing};
    });
    return found;
  };
  using Known = std::pair<std::uint64_t, bool>;
  CommandGate waiting(kRun, kVehicle, {kForceLimit});
  waiting.set_clients({kStrong});
  EXPECT_EQ(find(waiting, kStrongPeer), Known(0, false)) << "no state is published yet";
  set_clients({kStrong, kWeak});
  EXPECT_EQ(find(gate_, kStrongPeer), Known(0, true));
  gate_.offer(make_answer(0), kStrongPeer);
  gate_.offer(make_answer(0), kWeakPeer);  // superseded
  EXPECT_EQ(find(gate_, kStrongPeer), Known(1, false));
  EXPECT_EQ(find(gate_, kWeakPeer), Known(1, false));
  gate_.expect(1);
  gate_.expect(2);
  gate_.offer(make_answer(1), kWeakPeer);  // late
  EXPECT_EQ(find(gate_, kWeakPeer), Known(2, true));
  OfferedAnswer wrong = make_answer(2);
  wrong.run_id = kRun + 1;
  gate_.offer(wrong, kWeakPeer);
  EXPECT_EQ(find(gate_, kWeakPeer), Known(3, true)) << "refused, but its sender is there";
}

}  // namespace
}  // namespace sls::sim
