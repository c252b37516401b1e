#include "sim_server/core/run_control.hpp"

#include <gtest/gtest.h>

#include <limits>

namespace sls::sim {
namespace {

constexpr std::uint64_t kRun = 0x00c0ffee12345678;
constexpr std::uint32_t kVehicle = 3;

/// Requests of one operator. Each has its own id.
class Operator {
 public:
  explicit Operator(std::string name = "anna@host") : name_(std::move(name)) {}

  SimControl ask(ControlAction action, std::uint64_t steps = 0) {
    SimControl request;
    request.run_id(kRun);
    request.vehicle_id(kVehicle);
    request.request_id(next_id_++);
    request.operator_name(name_);
    request.action(action);
    request.steps(steps);
    return request;
  }

 private:
  std::string name_;
  std::uint64_t next_id_ = 1;
};

class RunControlTest : public ::testing::Test {
 protected:
  /// The reply to `action`, requested at step 40.
  std::optional<SimControlReply> ask(ControlAction action, std::uint64_t steps = 0) {
    return control.request(anna.ask(action, steps), 40);
  }
  void expect_accepted(const std::optional<SimControlReply>& reply, std::uint64_t step = 40) {
    ASSERT_TRUE(reply);
    EXPECT_TRUE(reply->accepted()) << reply->reason().c_str();
    EXPECT_STREQ(reply->reason().c_str(), "");
    EXPECT_EQ(reply->step(), step);
    EXPECT_EQ(reply->run_id(), kRun);
    EXPECT_EQ(reply->vehicle_id(), kVehicle);
  }
  void expect_refused(const std::optional<SimControlReply>& reply, const std::string& reason) {
    ASSERT_TRUE(reply);
    EXPECT_FALSE(reply->accepted());
    EXPECT_EQ(reply->reason().to_string(), reason);
  }

  Operator anna, bob{"bob@lab"};
  RunControl control{kRun, {kVehicle}, false};
};

TEST_F(RunControlTest, ARunGoesUntilItIsPausedAndOnWhenItIsResumed) {
  EXPECT_FALSE(control.holds());
  EXPECT_FALSE(control.is_paused());
  EXPECT_EQ(control.last_event(), "");

  expect_accepted(ask(ControlAction::ACTION_PAUSE));
  EXPECT_TRUE(control.holds());
  EXPECT_TRUE(control.is_paused());
  EXPECT_EQ(control.last_event(), "paused by anna@host");

  expect_accepted(control.request(bob.ask(ControlAction::ACTION_RESUME), 40));
  EXPECT_FALSE(control.holds());
  EXPECT_FALSE(control.is_paused());
  EXPECT_EQ(control.last_event(), "resumed by bob@lab");
}

TEST_F(RunControlTest, ARequestThatTheStateForbidsIsRefusedWithTheState) {
  expect_refused(ask(ControlAction::ACTION_RESUME), "not paused");
  expect_refused(ask(ControlAction::ACTION_START), "not paused");
  expect_refused(ask(ControlAction::ACTION_STEP, 1), "not paused");
  expect_accepted(ask(ControlAction::ACTION_PAUSE));
  expect_refused(ask(ControlAction::ACTION_PAUSE), "already paused");
  expect_refused(ask(ControlAction::ACTION_STEP, 0), "steps: expected at least 1, got 0");
  EXPECT_EQ(control.last_event(), "paused by anna@host") << "a refused request is no event";
}

TEST_F(RunControlTest, ARunThatBeginsPausedIsStarted) {
  RunControl successor(kRun, {kVehicle}, true);
  EXPECT_TRUE(successor.holds());
  EXPECT_TRUE(successor.is_paused());
  expect_accepted(successor.request(anna.ask(ControlAction::ACTION_START), 0), 0);
  EXPECT_FALSE(successor.holds());
  EXPECT_EQ(successor.last_event(), "started by anna@host");
}

TEST_F(RunControlTest, TheReplyToAStepRequestComesWhenItsStepsAreDone) {
  ask(ControlAction::ACTION_PAUSE);
  const SimControl request = anna.ask(ControlAction::ACTION_STEP, 3);
  EXPECT_EQ(control.request(request, 40), std::nullopt);
  EXPECT_EQ(control.last_event(), "3 steps requested by anna@host");
  for (const std::uint64_t step : {41, 42}) {
    EXPECT_FALSE(control.holds());
    EXPECT_EQ(control.stepped(step), std::nullopt);
  }
  EXPECT_FALSE(control.holds());
  const auto reply = control.stepped(43);
  expect_accepted(reply, 43);
  EXPECT_EQ(reply->request_id(), request.request_id());
  EXPECT_TRUE(control.holds());
  EXPECT_TRUE(control.is_paused());
}

TEST_F(RunControlTest, StepsOfAnUncontrolledRunBringNoReply) {
  EXPECT_EQ(control.stepped(1), std::nullopt);
  ask(ControlAction::ACTION_PAUSE);  // during the wait for the answer to step 40: the step is
                                     // completed
  EXPECT_EQ(control.stepped(41), std::nullopt);
  EXPECT_TRUE(control.holds());
}

TEST_F(RunControlTest, WhileStepsAreCarriedOutOthersAndResumeAreRefused) {
  ask(ControlAction::ACTION_PAUSE);
  ask(ControlAction::ACTION_STEP, 10);
  control.stepped(41);
  const std::string busy = "a step request is being carried out: 1 of 10 steps done";
  expect_refused(ask(ControlAction::ACTION_STEP, 1), busy);
  expect_refused(ask(ControlAction::ACTION_RESUME), busy);
  expect_refused(control.request(bob.ask(ControlAction::ACTION_START), 41), busy);
  EXPECT_FALSE(control.holds());
}

TEST_F(RunControlTest, APauseEndsAStepRequestAfterTheStepInWork) {
  ask(ControlAction::ACTION_PAUSE);
  const SimControl steps = anna.ask(ControlAction::ACTION_STEP, 1000);
  control.request(steps, 40);
  control.stepped(41);
  expect_accepted(control.request(bob.ask(ControlAction::ACTION_PAUSE), 41), 41);
  EXPECT_FALSE(control.holds()) << "the step that brings the reply is still to come";
  expect_refused(control.request(bob.ask(ControlAction::ACTION_PAUSE), 41), "already paused");
  const auto reply = control.stepped(42);
  expect_refused(reply, "paused by bob@lab: 2 of 1000 steps done");
  EXPECT_EQ(reply->request_id(), steps.request_id());
  EXPECT_EQ(reply->step(), 42u);
  EXPECT_TRUE(control.holds());
  EXPECT_EQ(control.stepped(43), std::nullopt);
}

TEST_F(RunControlTest, APauseDuringTheLastStepLeavesTheRequestFulfilled) {
  ask(ControlAction::ACTION_PAUSE);
  ask(ControlAction::ACTION_STEP, 1);
  expect_accepted(control.request(bob.ask(ControlAction::ACTION_PAUSE), 40));
  expect_accepted(control.stepped(41), 41);
}

TEST_F(RunControlTest, AnyNumberOfStepsMayBeAskedFor) {
  ask(ControlAction::ACTION_PAUSE);
  EXPECT_EQ(ask(ControlAction::ACTION_STEP, std::numeric_limits<std::uint64_t>::max()),
            std::nullopt);
  EXPECT_FALSE(control.holds());
  EXPECT_EQ(control.stepped(41), std::nullopt);
}

TEST_F(RunControlTest, ResetAndStopAreAcceptedAtAnyTime) {
  for (const auto action : {ControlAction::ACTION_RESET, ControlAction::ACTION_STOP})
    for (const bool is_paused : {false, true}) {
      RunControl run(kRun, {kVehicle}, is_paused);
      expect_accepted(run.request(anna.ask(action), 40));
      EXPECT_EQ(run.is_reset_requested(), action == ControlAction::ACTION_RESET);
      EXPECT_EQ(run.is_stop_requested(), action == ControlAction::ACTION_STOP);
      EXPECT_EQ(run.is_paused(), is_paused) << "what the successor of a reset run begins with";
      EXPECT_TRUE(run.holds());
    }
}

TEST_F(RunControlTest, ARunThatCarriesOutStepsIsAPausedOneForItsSuccessor) {
  ask(ControlAction::ACTION_PAUSE);
  ask(ControlAction::ACTION_STEP, 10);
  control.stepped(41);
  expect_accepted(ask(ControlAction::ACTION_RESET));
  EXPECT_TRUE(control.is_paused());
  EXPECT_TRUE(control.holds());
  expect_refused(control.end(41, "reset by anna@host"), "1 of 10 steps done: reset by anna@host");
}

TEST_F(RunControlTest, AnEndingRunAcceptsOnlyStopAndReset) {
  ask(ControlAction::ACTION_RESET);
  expect_refused(ask(ControlAction::ACTION_PAUSE), "the run is about to end: reset by anna@host");
  expect_accepted(ask(ControlAction::ACTION_RESET));
  expect_accepted(control.request(bob.ask(ControlAction::ACTION_STOP), 40));
  expect_refused(ask(ControlAction::ACTION_RESET), "the run is about to end: stopped by bob@lab");
  expect_accepted(ask(ControlAction::ACTION_STOP));
}

TEST_F(RunControlTest, TheEndOfARunAnswersOpenRequestsAndRefusesLaterOnes) {
  EXPECT_EQ(control.end(40, "mission finished"), std::nullopt);
  expect_refused(ask(ControlAction::ACTION_STOP), "the run has ended: mission finished");
  control.end(51, "a later failure");
  expect_refused(ask(ControlAction::ACTION_STOP), "the run has ended: mission finished");
  EXPECT_TRUE(control.holds());
  EXPECT_FALSE(control.is_stop_requested());
}

TEST_F(RunControlTest, RequestsForAnotherRunOrVehicleAreRefusedByName) {
  SimControl other_run = anna.ask(ControlAction::ACTION_STOP);
  other_run.run_id(kRun + 1);
  expect_refused(control.request(other_run, 40),
                 "run: expected 00c0ffee12345678, got 00c0ffee12345679");
  SimControl other_vehicle = anna.ask(ControlAction::ACTION_STOP);
  other_vehicle.vehicle_id(kVehicle + 1);
  const auto reply = control.request(other_vehicle, 40);
  expect_refused(reply, "vehicle: expected 3, got 4");
  EXPECT_EQ(reply->run_id(), kRun);
  EXPECT_EQ(reply->vehicle_id(), kVehicle);
  EXPECT_EQ(reply->request_id(), other_vehicle.request_id());
  EXPECT_FALSE(control.is_stop_requested());
}

TEST_F(RunControlTest, AnUnknownActionIsRefused) {
  for (const std::uint32_t value : {6u, 17u, 0xffffffffu}) {
    expect_refused(ask(static_cast<ControlAction>(value)),
                   "action: expected one of 0 to 5, got " + std::to_string(value));
    EXPECT_FALSE(control.holds());
  }
}

TEST_F(RunControlTest, ARepeatedRequestIsAnsweredAgainAndActsOnce) {
  const SimControl pause = anna.ask(ControlAction::ACTION_PAUSE);
  const auto first = control.request(pause, 40);
  ask(ControlAction::ACTION_RESUME);
  const auto again = control.request(pause, 55);
  EXPECT_EQ(again, first);
  EXPECT_FALSE(control.is_paused());

  SimControl of_bob = pause;  // the same number of another operator is another request
  of_bob.operator_name("bob@lab");
  expect_accepted(control.request(of_bob, 55), 55);
  EXPECT_TRUE(control.is_paused());
}

TEST_F(RunControlTest, ARepeatedStepRequestStepsOnce) {
  ask(ControlAction::ACTION_PAUSE);
  const SimControl steps = anna.ask(ControlAction::ACTION_STEP, 2);
  EXPECT_EQ(control.request(steps, 40), std::nullopt);
  control.stepped(41);
  EXPECT_EQ(control.request(steps, 41), std::nullopt) << "its reply is still to come";
  const auto reply = control.stepped(42);
  expect_accepted(reply, 42);
  EXPECT_EQ(control.request(steps, 42), reply);
  EXPECT_TRUE(control.holds());
}

TEST_F(RunControlTest, OnlyTheLastRepliesAreRemembered) {
  const SimControl pause = anna.ask(ControlAction::ACTION_PAUSE);
  control.request(pause, 40);
  for (std::size_t i = 0; i + 1 < RunControl::kRememberedReplies; ++i)
    ask(ControlAction::ACTION_PAUSE);
  expect_accepted(control.request(pause, 41));
  ask(ControlAction::ACTION_PAUSE);
  expect_refused(control.request(pause, 41), "already paused");
}

TEST_F(RunControlTest, AnOperatorsNameFitsOneLine) {
  Operator evil("eve\n\x1b[2J\x7f"), nameless("");
  control.request(evil.ask(ControlAction::ACTION_PAUSE), 40);
  EXPECT_EQ(control.last_event(), "paused by eve??[2J?");
  control.request(nameless.ask(ControlAction::ACTION_RESUME), 40);
  EXPECT_EQ(control.last_event(), "resumed by an operator without a name");
}

TEST_F(RunControlTest, OfAFleetAnyVehicleMayBeNamed) {
  RunControl fleet(kRun, {4, 5, 6}, false);
  SimControl request;
  request.run_id(kRun);
  request.request_id(1);
  request.action(ControlAction::ACTION_PAUSE);
  request.vehicle_id(6);
  const auto accepted = fleet.request(request, 0);
  ASSERT_TRUE(accepted);
  EXPECT_TRUE(accepted->accepted());
  EXPECT_EQ(accepted->vehicle_id(), 4u) << "the first stands for the run";
  request.request_id(2);
  request.vehicle_id(7);
  const auto refused = fleet.request(request, 0);
  ASSERT_TRUE(refused);
  EXPECT_FALSE(refused->accepted());
  EXPECT_STREQ(refused->reason().c_str(), "vehicle: expected 4-6, got 7");
}

}  // namespace
}  // namespace sls::sim
