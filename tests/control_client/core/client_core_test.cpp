#include "control_client/core/client_core.hpp"

#include <gtest/gtest.h>

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "tests/common/sync/samples.hpp"

namespace sls::control {
namespace {

using namespace sync;
using Act = ClientCore::Act;
using Phase = ClientCore::Phase;

constexpr auto kServer = peer(2), kReplacement = peer(3);
constexpr auto kRunning = RunPhase::PHASE_RUNNING;

/// A client of vehicles 4 and 7 that waits 60 s for a server and 7 s for a silent one.
class ClientCoreTest : public testing::Test {
 protected:
  ClientCoreTest() { begin(false); }

  /// A new client, and no server yet.
  void begin(bool follows_servers) {
    Participant identity;
    identity.name("pilot");
    core_.emplace(ClientCore::Options{{kVehicle, 7}, identity, 60, 7, follows_servers});
    servers_.emplace(peer(1)).set_present({kServer, kReplacement});
    now_ = 0;
  }

  Act look(std::int64_t ms, bool sees_server = false, bool is_stopped = false) {
    const Act act = core_->look(*servers_, {at(ms), is_stopped, sees_server});
    for (const Line& line : core_->take_lines())
      said_ += (line.is_warning ? "W " : "I ") + line.text + "\n";
    return act;
  }
  /// Looks every 20 ms, the last time at `ms`, and takes what was said before.
  Act look_until(std::int64_t ms) {
    said_.clear();
    Act act = Act::kNone;
    for (; act == Act::kNone && now_ <= ms; now_ += 20) act = look(now_);
    return act;
  }
  void serve(std::uint64_t run_id, const bus::PeerId& server, std::int64_t ms,
             RunPhase phase = kRunning) {
    servers_->note(claim(run_id, {3, kVehicle}), server, at(ms));
    servers_->note(status(run_id, phase), server, at(ms));
  }
  void join(std::int64_t ms = 0) {
    serve(kRun, kServer, ms);
    ASSERT_EQ(look(ms), Act::kBegin);
    now_ = ms + 20;
  }

  std::optional<Servers> servers_;
  std::optional<ClientCore> core_;
  std::int64_t now_ = 0;
  std::string said_;
};

TEST_F(ClientCoreTest, WaitsForAServerAndSaysSo) {
  EXPECT_EQ(look_until(1480), Act::kNone);
  EXPECT_EQ(said_, "");
  EXPECT_EQ(look_until(1500), Act::kNone);
  EXPECT_EQ(said_, "I waiting for: server of vehicle 4,7 (58 s left)\n");
  EXPECT_EQ(look_until(6480), Act::kNone);
  EXPECT_EQ(said_, "");
  EXPECT_EQ(look_until(6500), Act::kNone);
  EXPECT_EQ(said_, "I waiting for: server of vehicle 4,7 (54 s left)\n");
  EXPECT_EQ(look_until(59'980), Act::kNone);
  EXPECT_EQ(look_until(60'000), Act::kGiveUp);
  EXPECT_EQ(core_->error(), "no server for vehicle 4,7 within 60 s");
  EXPECT_EQ(look(60'020), Act::kNone) << "it has ended";
}

TEST_F(ClientCoreTest, TheWaitBeginsWithTheFirstLook) {
  now_ = 100'000;
  EXPECT_EQ(look_until(159'980), Act::kNone);
  EXPECT_EQ(look_until(160'000), Act::kGiveUp);
}

TEST_F(ClientCoreTest, JoinsARunOnceItsClaimIsSettledAndIsReadyOnceItSeesTheServer) {
  servers_->note(claim(kRun, {3, kVehicle}), kServer, at(0));
  EXPECT_EQ(look(0), Act::kNone);
  EXPECT_TRUE(core_->list_flown_ids().empty());
  serve(kRun, kServer, 20, RunPhase::PHASE_WAITING);
  EXPECT_EQ(look(20), Act::kBegin);
  EXPECT_EQ(core_->phase(), Phase::kFlying);
  EXPECT_EQ(core_->run()->parameters.run_id(), kRun);
  EXPECT_EQ(core_->list_flown_ids(), std::vector<std::uint32_t>{kVehicle}) << "it has no 7";
  EXPECT_EQ(look(40), Act::kNone);
  EXPECT_EQ(look(60, true), Act::kAnnounceReady);
  EXPECT_EQ(look(80, true), Act::kNone) << "once";
}

TEST_F(ClientCoreTest, AnnouncesWhatItFlies) {
  using Ids = std::vector<std::uint32_t>;
  const auto is = [this](std::uint64_t run_id, const Ids& ids, bool is_ready, bool is_done) {
    const Participant message = core_->make_announcement();
    return message.name() == "pilot" && message.role() == ParticipantRole::ROLE_CONTROLLER &&
           message.run_id() == run_id && message.vehicle_ids() == ids &&
           message.ready() == is_ready && message.done() == is_done;
  };
  EXPECT_TRUE(is(0, {kVehicle, 7}, false, false)) << "while it waits for a server";
  join();
  EXPECT_TRUE(is(kRun, {kVehicle}, false, false));
  look(20, true);
  EXPECT_TRUE(is(kRun, {kVehicle}, true, false));
  serve(kRun, kServer, 40, RunPhase::PHASE_FINISHED);
  look(40);
  EXPECT_TRUE(is(kRun, {kVehicle}, false, true));
}

TEST_F(ClientCoreTest, FollowsTheLastOfManyResetsAlthoughItsOwnRunIsForgotten) {
  join();
  const std::uint64_t last = kRun + Servers::kMostRuns;
  for (std::uint64_t run_id = kRun + 1; run_id <= last; ++run_id) serve(run_id, kServer, 20);
  EXPECT_EQ(look(20), Act::kBegin);
  EXPECT_EQ(core_->run()->parameters.run_id(), last);
}

TEST_F(ClientCoreTest, LooksMoreOftenWhileItHasNoRun) {
  look(0);
  EXPECT_EQ(core_->next_deadline(), at(5));
  join(5);
  EXPECT_EQ(core_->next_deadline(), at(5)) << "it may be ready at once";
  look(5, true);
  EXPECT_EQ(core_->next_deadline(), at(25));
}

TEST_F(ClientCoreTest, LeavesWithTheRun) {
  join();
  serve(kRun, kServer, 20, RunPhase::PHASE_PAUSED);
  EXPECT_EQ(look(20), Act::kNone);
  serve(kRun, kServer, 40, RunPhase::PHASE_FINISHED);
  EXPECT_EQ(look(40), Act::kLeave);
  EXPECT_EQ(core_->error(), "");
  EXPECT_EQ(look(60), Act::kNone);
}

TEST_F(ClientCoreTest, AFailedRunIsAnErrorOfTheClientToo) {
  join();
  SimStatus failed = status(kRun, RunPhase::PHASE_FAILED);
  failed.reason("the load is lost");
  servers_->note(failed, kServer, at(20));
  EXPECT_EQ(look(20), Act::kLeave);
  EXPECT_EQ(core_->error(), "the run failed: the load is lost");
}

TEST_F(ClientCoreTest, FollowsAResetAndIsReadyAnew) {
  join();
  EXPECT_EQ(look(20, true), Act::kAnnounceReady);
  servers_->note(status(kRun, RunPhase::PHASE_RESET), kServer, at(30));
  serve(kRun + 1, kServer, 30, RunPhase::PHASE_WAITING);
  EXPECT_EQ(look(40, true), Act::kBegin);
  EXPECT_EQ(said_, "W run 00000000000001f4 was reset to run 00000000000001f5: following it\n");
  EXPECT_EQ(core_->run()->parameters.run_id(), kRun + 1);
  EXPECT_EQ(look(60, true), Act::kAnnounceReady);
}

TEST_F(ClientCoreTest, AResetWithoutANewRunIsWaitedForLikeASilentServer) {
  join();
  servers_->note(status(kRun, RunPhase::PHASE_RESET), kServer, at(20));
  EXPECT_EQ(look_until(7999), Act::kNone);
  EXPECT_EQ(look_until(8020), Act::kGiveUp);
}

TEST_F(ClientCoreTest, ASilentServerIsReportedAndGivenUpAfterItsDeadline) {
  join();
  EXPECT_EQ(look_until(980), Act::kNone);
  EXPECT_EQ(said_, "");
  EXPECT_EQ(look_until(1000), Act::kNone);
  EXPECT_EQ(said_, "W waiting for: server of run 00000000000001f4 (silent for 1.0 s) (7 s left)\n");
  EXPECT_EQ(look_until(7980), Act::kNone);
  EXPECT_EQ(look_until(8000), Act::kGiveUp);
  EXPECT_EQ(core_->error(),
            "the server of run 00000000000001f4 (silent for 8.0 s), expected it to finish");
}

TEST_F(ClientCoreTest, AServerThatComesBackIsFlownOn) {
  join();
  EXPECT_EQ(look_until(4000), Act::kNone);
  serve(kRun, kServer, 4010);
  EXPECT_EQ(look_until(4020), Act::kNone);
  EXPECT_EQ(said_, "I the server of run 00000000000001f4 is back\n");
}

TEST_F(ClientCoreTest, AReplacementIsFollowedOnlyIfThatIsWanted) {
  for (const bool follows : {false, true}) {
    begin(follows);
    join();
    EXPECT_EQ(look_until(1500), Act::kNone);
    serve(kRun + 5, kReplacement, 1500, RunPhase::PHASE_WAITING);
    EXPECT_EQ(look_until(1999), Act::kNone) << "the first one may come back";
    if (follows) {
      EXPECT_EQ(look_until(2020), Act::kBegin);
      EXPECT_EQ(core_->run()->server, kReplacement);
    } else {
      EXPECT_EQ(look_until(2020), Act::kGiveUp);
      EXPECT_EQ(core_->error(),
                "run 00000000000001f4 was replaced by run 00000000000001f9 (see --follow)");
    }
  }
}

TEST_F(ClientCoreTest, EveryEventInEveryPhase) {
  struct Event {
    const char* name;
    std::function<Act()> happen;
    Act finding, flying;  // an ended client does nothing
  };
  const std::vector<Event> events = {
      {"nothing", [&] { return look(20); }, Act::kNone, Act::kNone},
      {"it sees the server", [&] { return look(20, true); }, Act::kNone, Act::kAnnounceReady},
      {"stop", [&] { return look(20, false, true); }, Act::kGiveUp, Act::kLeave},
      {"a run waits", [&] { return serve(kRun, kServer, 20, RunPhase::PHASE_WAITING), look(20); },
       Act::kBegin, Act::kNone},
      {"it runs", [&] { return serve(kRun, kServer, 20), look(20); }, Act::kBegin, Act::kNone},
      {"it is over", [&] { return serve(kRun, kServer, 20, RunPhase::PHASE_FINISHED), look(20); },
       Act::kNone, Act::kLeave},
      {"it failed", [&] { return serve(kRun, kServer, 20, RunPhase::PHASE_FAILED), look(20); },
       Act::kNone, Act::kLeave},
      {"time", [&] { return look(0), look_until(60'000); }, Act::kGiveUp, Act::kGiveUp},
  };
  for (const Phase phase : {Phase::kFinding, Phase::kFlying, Phase::kEnded})
    for (const Event& event : events) {
      begin(false);
      if (phase == Phase::kFlying) join();
      if (phase == Phase::kEnded) look(0, false, true);
      ASSERT_EQ(core_->phase(), phase);
      EXPECT_EQ(event.happen(), phase == Phase::kFinding  ? event.finding
                                : phase == Phase::kFlying ? event.flying
                                                          : Act::kNone)
          << event.name << " in phase " << static_cast<int>(phase);
    }
}

}  // namespace
}  // namespace sls::control
