// The server before step 0: docs/synchronisation.md, "Identity" and "Waiting for participants".
#include <gtest/gtest.h>

#include "tests/sim_server/core/server_rig.hpp"

namespace sls::sim {
namespace {

const ServerCore::Start kClaims{ServerRig::kRunId, true, false};

sync::Run make_rival(std::uint64_t run_id) {
  sync::Run run;
  run.parameters = sync::claim(run_id, {0});
  return run;
}

TEST(ServerStartTest, OnThisMachineTheClaimTakesAQuarterOfASecond) {
  ServerRig rig(ServerRig::make_scenario(), kClaims);
  rig.wait_until(249);
  EXPECT_EQ(rig.phase(), Phase::kClaiming);
  EXPECT_TRUE(rig.statuses().empty());
  rig.wait_until(250);
  EXPECT_EQ(rig.phase(), Phase::kGathering);
  EXPECT_EQ(rig.status().phase(), RunPhase::PHASE_WAITING);
  EXPECT_EQ(rig.status().reason().to_string(), "participants are not ready");
}

TEST(ServerStartTest, OnANetworkOrWithAnUnheardClaimItTakesOneSecond) {
  for (const bool is_on_this_machine : {true, false}) {
    ServerRig rig(ServerRig::make_scenario(), kClaims);
    rig.is_on_this_machine = is_on_this_machine;
    rig.knows_every_claim = !is_on_this_machine;
    rig.wait_until(999);
    EXPECT_EQ(rig.phase(), Phase::kClaiming);
    rig.wait_until(1000);
    EXPECT_EQ(rig.phase(), Phase::kGathering);
  }
}

TEST(ServerStartTest, TheServerThatLosesItsClaimPublishesNothing) {
  ServerRig rig(ServerRig::make_scenario(), kClaims);
  rig.wait_until(245);
  rig.other_runs = {make_rival(ServerRig::kRunId - 1)};
  rig.wait_until(250);
  EXPECT_EQ(rig.core().end(), ServerCore::End::kFailed);
  EXPECT_EQ(rig.core().error(),
            "vehicle 0: expected no other server on this domain, got one (run 00000000000001f3)");
  EXPECT_TRUE(rig.statuses().empty());
  EXPECT_FALSE(rig.core().is_known());
}

TEST(ServerStartTest, TheRunAfterAResetClaimsUnlessTheOneBeforeHasClaimed) {
  for (const bool has_claimed : {false, true}) {
    ServerRig rig(ServerRig::make_scenario(), kClaims);
    rig.wait_until(has_claimed ? 250 : 245);
    rig.request(ControlAction::ACTION_RESET);
    EXPECT_EQ(rig.core().end(), ServerCore::End::kReset);
    EXPECT_EQ(rig.core().make_next_start().claims, !has_claimed);
  }
}

TEST(ServerStartTest, ARunThatEndsBeforeTheClaimIsSettledIsNoRival) {
  ServerRig rig(ServerRig::make_scenario(), kClaims);
  rig.other_runs = {make_rival(ServerRig::kRunId - 1)};
  // The history of its status arrives sample by sample.
  for (const RunPhase phase :
       {RunPhase::PHASE_WAITING, RunPhase::PHASE_RUNNING, RunPhase::PHASE_FINISHED}) {
    rig.other_runs.front().status = sync::status(ServerRig::kRunId - 1, phase);
    rig.wait_until(phase == RunPhase::PHASE_FINISHED ? 250 : 245);
  }
  EXPECT_EQ(rig.phase(), Phase::kGathering);
}

TEST(ServerStartTest, AServerInALaterPhaseLosesToNoClaim) {
  ServerRig rig;
  rig.other_runs = {make_rival(ServerRig::kRunId - 1)};
  rig.wait_until(1000);
  EXPECT_EQ(rig.phase(), Phase::kGathering);
  rig.other_runs.front().status = sync::status(ServerRig::kRunId - 1, RunPhase::PHASE_RUNNING);
  rig.wait_until(1420);
  EXPECT_EQ(rig.core().end(), ServerCore::End::kFailed) << "but to one that flies";
}

TEST(ServerStartTest, TheFlightBeginsWithTheLookThatFindsEverybodyReady) {
  ServerRig rig;
  rig.join("pilot", 0, false);
  rig.wait_until(100);
  EXPECT_EQ(rig.phase(), Phase::kGathering);
  rig.join("pilot");
  EXPECT_EQ(rig.phase(), Phase::kAwaitingAnswers);
  EXPECT_EQ(rig.take_states(), Lines{"100: state 0"});
  EXPECT_EQ(rig.status().phase(), RunPhase::PHASE_RUNNING);
}

TEST(ServerStartTest, TheMissingAreNamedAndGivenUpAfterTheTimeout) {
  ServerRig rig;
  rig.wait_until(299);
  EXPECT_EQ(rig.take_log(), Lines{});
  rig.wait_until(300);
  EXPECT_EQ(rig.take_log(), Lines{"300: waiting for: controller (30 s left)"});
  EXPECT_EQ(rig.status().reason().to_string(), "missing: controller");
  rig.wait_until(5299);
  EXPECT_EQ(rig.take_log(), Lines{});
  rig.wait_until(5300);
  EXPECT_EQ(rig.take_log(), Lines{"5300: waiting for: controller (25 s left); run ./sls doctor"});
  rig.wait_until(29'999);
  EXPECT_EQ(rig.phase(), Phase::kGathering);
  rig.wait_until(30'000);
  EXPECT_EQ(rig.core().error(), "not ready within 30 s: controller");
  EXPECT_EQ(rig.status().phase(), RunPhase::PHASE_FAILED);
  EXPECT_EQ(rig.status().reason().to_string(), rig.core().error());
}

TEST(ServerStartTest, AParticipantThatLeftOrFellSilentIsMissingAgain) {
  auto scenario = ServerRig::make_scenario();
  scenario.sync.wait_for.controllers = 2;
  ServerRig rig(scenario);
  rig.join("a");
  rig.leave("a");
  rig.join("b");
  EXPECT_EQ(rig.phase(), Phase::kGathering);
  rig.fall_silent("b");
  rig.wait(2200);
  rig.join("a");
  EXPECT_EQ(rig.phase(), Phase::kGathering) << "b is presumed dead";
  rig.join("b");
  EXPECT_EQ(rig.phase(), Phase::kAwaitingAnswers);
}

TEST(ServerStartTest, APausedStartRestsAtStep0) {
  ServerRig rig;
  rig.request(ControlAction::ACTION_PAUSE);
  EXPECT_EQ(rig.status().phase(), RunPhase::PHASE_WAITING) << "until the participants are ready";
  rig.join("pilot");
  EXPECT_EQ(rig.phase(), Phase::kResting);
  EXPECT_EQ(rig.take_states(), Lines{});
  EXPECT_EQ(rig.status().phase(), RunPhase::PHASE_PAUSED);
  rig.request(ControlAction::ACTION_START);
  EXPECT_EQ(rig.take_states(), Lines{"0: state 0"});
}

TEST(ServerStartTest, ARequestForAnotherServerIsLeftToIt) {
  ServerRig rig;
  rig.request(ControlAction::ACTION_PAUSE, 0, 7);
  ASSERT_EQ(rig.replies().size(), 1u) << "nobody else has run 7";
  EXPECT_FALSE(rig.replies().back().accepted());
  rig.other_runs = {make_rival(7)};
  rig.other_runs.front().parameters = sync::claim(7, {5});
  rig.request(ControlAction::ACTION_PAUSE, 0, 7);
  EXPECT_EQ(rig.replies().size(), 1u);
}

}  // namespace
}  // namespace sls::sim
