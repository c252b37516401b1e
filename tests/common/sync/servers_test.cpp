#include "common/sync/servers.hpp"

#include <gtest/gtest.h>

#include "common/sync/server_watch.hpp"
#include "tests/common/sync/samples.hpp"

namespace sls::sync {
namespace {

constexpr auto kSelf = peer(1), kServer = peer(2), kStranger = peer(3), kReplacement = peer(4);
constexpr auto kWaiting = RunPhase::PHASE_WAITING, kRunning = RunPhase::PHASE_RUNNING;

class ServersTest : public testing::Test {
 protected:
  ServersTest() { servers_.set_present({kSelf, kServer, kStranger, kReplacement}); }

  /// The run id of the run to join; 0 if none.
  std::uint64_t joinable(std::int64_t now_ms, std::uint32_t vehicle_id = kVehicle) const {
    const auto run = servers_.find_joinable(vehicle_id, at(now_ms));
    return run ? run->parameters.run_id() : 0;
  }

  Servers servers_{kSelf};
};

TEST_F(ServersTest, ARunIsJoinableOnceItsClaimIsSettled) {
  servers_.note(claim(kRun, {kVehicle - 1, kVehicle}), kServer, at(0));
  EXPECT_EQ(servers_.runs(at(0)).size(), 1u);
  EXPECT_EQ(joinable(0), 0u) << "no status: the claim is not settled";
  servers_.note(status(kRun, kWaiting), kServer, at(1));
  EXPECT_EQ(joinable(1), kRun);
  EXPECT_EQ(joinable(1, kVehicle + 1), 0u);
  EXPECT_EQ(servers_.find_joinable(kVehicle, at(1))->server, kServer);
  for (const RunPhase phase :
       {RunPhase::PHASE_FINISHED, RunPhase::PHASE_FAILED, RunPhase::PHASE_RESET}) {
    servers_.note(status(kRun, phase), kServer, at(2));
    EXPECT_EQ(joinable(2), 0u);
  }
}

TEST_F(ServersTest, TheRunThatIsAheadIsJoinedThenTheOneWithTheLowerId) {
  servers_.note(claim(kRun, {kVehicle}), kServer, at(0));
  servers_.note(claim(kLowerRun, {kVehicle}), kStranger, at(0));
  servers_.note(status(kRun, kWaiting), kServer, at(0));
  servers_.note(status(kLowerRun, kWaiting), kStranger, at(0));
  EXPECT_EQ(joinable(0), kLowerRun);
  servers_.note(status(kRun, kRunning), kServer, at(0));
  EXPECT_EQ(joinable(0), kRun);
  servers_.note(status(kLowerRun, RunPhase::PHASE_PAUSED), kStranger, at(0));
  EXPECT_EQ(joinable(0), kLowerRun) << "as far as a running one";
  servers_.note(status(kRun, kWaiting), kServer, at(0));
  EXPECT_EQ(joinable(0), kLowerRun);
  servers_.set_present({kServer});
  EXPECT_EQ(joinable(0), kRun);
  EXPECT_EQ(servers_.find_status(kLowerRun)->phase(), RunPhase::PHASE_PAUSED)
      << "also when it has gone";
  EXPECT_EQ(servers_.find_status(kLowerRun + 1), nullptr);
}

TEST_F(ServersTest, AServerThatIsSilentForTwoSecondsIsNotJoinedButMayComeBack) {
  servers_.note(claim(kRun, {kVehicle}), kServer, at(0));
  servers_.note(status(kRun, kRunning), kServer, at(0));
  EXPECT_EQ(joinable(2000), kRun);
  EXPECT_FALSE(servers_.is_silent(kRun, at(2000)));
  EXPECT_EQ(servers_.find_joinable(kVehicle, at(2000) + 1ns), std::nullopt);
  EXPECT_TRUE(servers_.is_silent(kRun, at(2000) + 1ns));
  EXPECT_FALSE(servers_.is_known(kRun, at(2001)));
  servers_.note(status(kRun, kRunning), kServer, at(3000));
  EXPECT_EQ(joinable(3000), kRun);
  servers_.note(status(kRun, RunPhase::PHASE_FINISHED), kServer, at(3000));
  EXPECT_TRUE(servers_.is_known(kRun, at(9000))) << "a run that has ended may be silent";
}

TEST_F(ServersTest, OnlyTheFirstServerOfARunCounts) {
  servers_.note(claim(kRun, {kVehicle}), kServer, at(0));
  servers_.note(status(kRun, kRunning), kServer, at(0));
  EXPECT_FALSE(servers_.note(status(kRun, RunPhase::PHASE_FINISHED), kStranger, at(1)));
  auto impostors = servers_.take_impostors();
  ASSERT_EQ(impostors.size(), 1u);
  EXPECT_EQ(impostors[0].sender, kStranger);
  EXPECT_EQ(impostors[0].owner, kServer);
  EXPECT_STREQ(impostors[0].topic, "sls/status");
  EXPECT_EQ(impostors[0].run_id, kRun);
  servers_.note(claim(kRun, {kVehicle + 1}), kStranger, at(2));
  EXPECT_TRUE(servers_.take_impostors().empty()) << "each server once";
  EXPECT_EQ(servers_.find_status(kRun)->phase(), kRunning);
  EXPECT_TRUE(servers_.may_fly(kRun, kVehicle));
  EXPECT_FALSE(servers_.may_fly(kRun, kVehicle + 1));
  EXPECT_TRUE(servers_.may_fly(kRun + 1, kVehicle)) << "nobody knows this run";
  ASSERT_EQ(servers_.runs(at(2)).size(), 1u);
  EXPECT_EQ(servers_.runs(at(2)).front().server, kServer);
}

TEST_F(ServersTest, AServerThatClaimsTheRunOfAnotherOneIsReportedToo) {
  servers_.note(claim(kLowerRun, {kVehicle}), kServer, at(0));
  servers_.note(claim(kRun, {kVehicle}), kReplacement, at(0));
  servers_.note(claim(kRun, {kVehicle}), kStranger, at(1));
  const auto impostors = servers_.take_impostors();
  ASSERT_EQ(impostors.size(), 1u);
  EXPECT_EQ(impostors[0].sender, kStranger);
  EXPECT_EQ(impostors[0].owner, kReplacement);
  EXPECT_STREQ(impostors[0].topic, "sls/parameters");
}

TEST_F(ServersTest, AStatusThatComesBeforeTheClaimOfItsRunIsFoundOutByTheClaim) {
  EXPECT_TRUE(servers_.note(status(kRun, RunPhase::PHASE_FINISHED), kStranger, at(0)));
  EXPECT_TRUE(servers_.runs(at(0)).empty());
  EXPECT_FALSE(servers_.has_claimed(kStranger));
  EXPECT_FALSE(servers_.has_claimed(kServer));
  EXPECT_TRUE(servers_.take_impostors().empty());
  servers_.note(claim(kRun, {kVehicle}), kServer, at(1));
  EXPECT_EQ(servers_.take_impostors().size(), 1u);
  EXPECT_EQ(servers_.find_status(kRun), nullptr);
}

TEST_F(ServersTest, AWriterWithoutAClaimIsAnImpostorAfterAWhile) {
  const std::map<bus::PeerId, std::set<std::string>> writers{{kServer, {"sls/state"}},
                                                             {peer(8), {"sls/state"}}};
  servers_.look_for_unclaimed(writers, at(0));
  EXPECT_TRUE(servers_.look_for_unclaimed(writers, at(999)).found.empty());
  auto unclaimed = servers_.look_for_unclaimed(writers, at(1000));
  ASSERT_EQ(unclaimed.found.size(), 1u);
  EXPECT_EQ(unclaimed.found.count(peer(8)), 1u);
  // kServer has a writer of claims, whose sample may be late on a lossy network.
  EXPECT_EQ(servers_.look_for_unclaimed(writers, at(9999)).found.size(), 1u);
  EXPECT_EQ(servers_.look_for_unclaimed(writers, at(10'000)).found.size(), 2u);
  servers_.note(claim(kRun, {kVehicle}), kServer, at(10'001));
  unclaimed = servers_.look_for_unclaimed(writers, at(10'002));
  EXPECT_EQ(unclaimed.found.size(), 1u);
  EXPECT_EQ(unclaimed.settled, std::vector{kServer});
  EXPECT_TRUE(servers_.look_for_unclaimed(writers, at(10'002)).settled.empty()) << "said once";
  // One that has gone begins again.
  servers_.look_for_unclaimed({}, at(10'003));
  EXPECT_TRUE(servers_.look_for_unclaimed(writers, at(10'004)).found.empty());
}

// A late joiner receives the history of each topic; either topic may come first.
TEST_F(ServersTest, AfterManyResetsTheLastRunIsFoundWhicheverTopicComesFirst) {
  constexpr std::uint64_t kRuns = 9, kLast = kRun + kRuns - 1;
  for (const bool are_claims_first : {true, false}) {
    Servers servers(kSelf);
    servers.set_present({kServer});
    const auto note_claims = [&] {
      for (std::uint64_t i = 0; i < kRuns; ++i)
        servers.note(claim(kRun + i, {kVehicle}), kServer, at(0));
    };
    if (are_claims_first) note_claims();
    for (std::uint64_t id = kRun; id <= kLast; ++id)
      for (const RunPhase phase : {kWaiting, id < kLast ? RunPhase::PHASE_RESET : kRunning})
        servers.note(status(id, phase), kServer, at(0));
    if (!are_claims_first) note_claims();
    // A recorder reads from the last status of its run that the run was reset.
    ASSERT_TRUE(servers.find_status(kLast - 1));
    EXPECT_EQ(servers.find_status(kLast - 1)->phase(), RunPhase::PHASE_RESET);
    EXPECT_EQ(servers.find_joinable(kVehicle, at(0))->parameters.run_id(), kLast);
    EXPECT_TRUE(servers.is_known(kLast, at(0)));
    EXPECT_FALSE(servers.is_known(kLast - 1, at(0))) << "it is over";
    EXPECT_FALSE(servers.is_known(kLast + 1, at(0)));
  }
}

// A server is also presumed dead if its samples are late because this process or the network is
// overloaded. A second server that claimed the same vehicle before must not take its place then.
TEST_F(ServersTest, OnlyAServerThatComesAfterTheSilenceBeganIsASuccessor) {
  servers_.note(claim(kRun, {kVehicle}), kServer, at(0));
  servers_.note(status(kRun, kRunning), kServer, at(10));
  servers_.note(claim(kLowerRun, {kVehicle}), kStranger, at(10));
  const sync::Run run = *servers_.find_joinable(kVehicle, at(10));
  const auto successor = [&](std::int64_t now_ms) {
    const auto next = servers_.find_successor(run, {kVehicle}, at(now_ms));
    return next ? next->parameters.run_id() : 0;
  };
  servers_.note(status(kLowerRun, kWaiting), kStranger, at(2500));
  EXPECT_EQ(successor(2500), 0u) << "it was there before the silence began";

  servers_.note(claim(kRun + 1, {kVehicle}), kReplacement, at(2600));
  servers_.note(status(kRun + 1, kWaiting), kReplacement, at(2600));
  EXPECT_EQ(successor(2600), kRun + 1);
  EXPECT_EQ(servers_.find_successor(run, {kVehicle + 1}, at(2600)), std::nullopt);
  servers_.note(status(kRun, kRunning), kServer, at(2700));
  EXPECT_EQ(successor(2700), 0u) << "the server is heard again";

  // The run's own server may start another run at any time.
  servers_.note(claim(kRun + 2, {kVehicle}), kServer, at(2800));
  servers_.note(status(kRun + 2, kRunning), kServer, at(2800));
  EXPECT_EQ(successor(2800), kRun + 2);
}

TEST_F(ServersTest, AServerWithoutAStatusIsSilentAndAnyOtherReplacesIt) {
  servers_.note(claim(kRun, {kVehicle}), kServer, at(0));
  const sync::Run run = servers_.runs(at(0)).front();
  EXPECT_EQ(servers_.find_last_heard(kRun), std::nullopt);
  EXPECT_TRUE(servers_.is_silent(kRun, at(0)));
  servers_.note(claim(kRun + 1, {kVehicle}), kReplacement, at(1));
  servers_.note(status(kRun + 1, kWaiting), kReplacement, at(1));
  EXPECT_EQ(servers_.find_successor(run, {kVehicle}, at(1))->server, kReplacement);
}

TEST_F(ServersTest, AServerDoesNotMeetItself) {
  servers_.note(claim(kRun, {kVehicle}), kSelf, at(0));
  servers_.note(status(kRun, kRunning), kSelf, at(0));
  EXPECT_TRUE(servers_.find_status(kRun));
  EXPECT_TRUE(servers_.runs(at(0)).empty());
  EXPECT_EQ(joinable(0), 0u);
}

TEST_F(ServersTest, OthersCannotFillTheMemory) {
  servers_.note(claim(1, {kVehicle}), kSelf, at(0));
  std::set<bus::PeerId> present;
  for (std::uint8_t i = 0; i < 80; ++i) present.insert(peer(static_cast<std::uint8_t>(100 + i)));
  servers_.set_present(present);
  for (const bus::PeerId& stranger : present)
    servers_.note(claim(1000u + stranger.bytes[0], {kVehicle}), stranger, at(0));
  EXPECT_EQ(servers_.runs(at(0)).size(), Servers::kMostServers - 1);
  EXPECT_FALSE(servers_.note(status(kRun, kRunning), kServer, at(0))) << "no room";
  servers_.set_present({kServer});
  servers_.note(claim(kRun, {kVehicle}), kServer, at(0));
  EXPECT_EQ(servers_.runs(at(0)).size(), 1u) << "one that has left makes room";
  EXPECT_TRUE(servers_.has_claimed(kSelf)) << "our own run stays";
  servers_.note(status(kRun, kRunning), kServer, at(0));
  servers_.set_present({});
  for (std::uint8_t i = 180; i < 250; ++i) servers_.note(status(i, kRunning), peer(i), at(0));
  EXPECT_TRUE(servers_.find_status(kRun)) << "the last word of a server that left a moment ago";
}

TEST(ProgressTest, ARunningServerIsFurtherThanAWaitingOneAndAnEndedOneIsNoServer) {
  const auto progress = [](RunPhase phase) { return calc_progress(status(1, phase)); };
  EXPECT_LT(calc_progress(std::nullopt), progress(kWaiting));
  EXPECT_LT(progress(kWaiting), progress(kRunning));
  EXPECT_EQ(progress(kRunning), progress(RunPhase::PHASE_PAUSED));
  EXPECT_LT(progress(RunPhase::PHASE_FINISHED), 0);
  EXPECT_LT(progress(RunPhase::PHASE_FAILED), 0);
}

TEST(ClaimTest, AServerServesTheVehiclesItNames) {
  EXPECT_TRUE(serves_vehicle(claim(1, {0, 7}), 7));
  EXPECT_FALSE(serves_vehicle(claim(1, {0, 7}), 1));
  EXPECT_FALSE(serves_vehicle(claim(1, {}), 0));
  EXPECT_EQ(list_vehicle_ids(claim(1, {0, 7})), std::vector<std::uint32_t>({0, 7}));
}

}  // namespace
}  // namespace sls::sync
