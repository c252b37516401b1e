#include "recorder/core/run_watch.hpp"

#include <gtest/gtest.h>

#include <optional>
#include <string>

#include "tests/common/sync/samples.hpp"

namespace sls::record {
namespace {

using namespace sync;

constexpr auto kServer = peer(2), kReplacement = peer(3);
constexpr auto kRunning = RunPhase::PHASE_RUNNING;

/// A recording of vehicle 4 from time 0 on; a server that is silent for 7 s is lost.
class RunWatchTest : public testing::Test {
 protected:
  RunWatchTest() {
    servers_.set_present({kServer, kReplacement});
    serve(kRun, kServer, 0, kRunning);
    watch_.emplace(*servers_.find_joinable(kVehicle, at(0)), kVehicle, 7, RunWatch::Now{at(0)});
  }

  void serve(std::uint64_t run_id, const bus::PeerId& server, std::int64_t ms, RunPhase phase) {
    servers_.note(claim(run_id, {kVehicle}), server, at(ms));
    servers_.note(status(run_id, phase), server, at(ms));
  }
  bool look(std::int64_t ms, std::int64_t step = 5, const std::string& interruption = "") {
    const bool is_over = watch_->look(servers_, {at(ms), interruption, true, step});
    for (const Line& line : watch_->take_lines())
      said_ += (line.is_warning ? "W " : "I ") + line.text + "\n";
    return is_over;
  }
  /// Looks every 5 ms until `ms`. @returns when the watch was over; −1 if it was not.
  std::int64_t look_until(std::int64_t ms, std::int64_t step = 5,
                          const std::string& interruption = "") {
    said_.clear();
    for (; now_ <= ms; now_ += 5)
      if (look(now_, step, interruption)) return now_;
    return -1;
  }

  Servers servers_{peer(1)};
  std::optional<RunWatch> watch_;
  std::int64_t now_ = 0;
  std::string said_;
};

TEST_F(RunWatchTest, AfterTheEndEachNewStepIsWaitedForTenSeconds) {
  EXPECT_EQ(look_until(900), -1);
  servers_.note(status(kRun, RunPhase::PHASE_FINISHED), kServer, at(900));
  EXPECT_EQ(look_until(9000, 6), -1);
  EXPECT_EQ(said_,
            "I waiting for: samples after step 6 of run 00000000000001f4 (9 s left)\n"
            "I waiting for: samples after step 6 of run 00000000000001f4 (4 s left)\n");
  EXPECT_EQ(look_until(30'000, 7), 19'005) << "10 s after the look that saw step 7";
  EXPECT_EQ(watch_->end().outcome, "interrupted");
  EXPECT_EQ(watch_->end().interruption, "") << "the gaps say what is missing";
}

TEST_F(RunWatchTest, AfterAFailureOrAResetOneSecondIsWaited) {
  for (const RunPhase phase : {RunPhase::PHASE_FAILED, RunPhase::PHASE_RESET}) {
    watch_.emplace(*servers_.find_joinable(kVehicle, at(0)), kVehicle, 7, RunWatch::Now{at(0)});
    now_ = 0;
    EXPECT_EQ(look_until(500), -1);
    servers_.note(status(kRun, phase), kServer, at(500));
    EXPECT_EQ(look_until(3000, 9), 1505) << "also if steps come";
    servers_.note(status(kRun, kRunning), kServer, at(0));
  }
}

TEST_F(RunWatchTest, AStopSignalShortensEveryWait) {
  servers_.note(status(kRun, RunPhase::PHASE_FINISHED), kServer, at(0));
  EXPECT_EQ(look_until(1000), -1);
  EXPECT_EQ(look_until(9000, 5, "interrupted by SIGTERM"), 1505);
  EXPECT_EQ(watch_->end().interruption, "interrupted by SIGTERM");
}

TEST_F(RunWatchTest, ALostServerEndsTheRecordingAtItsDeadline) {
  EXPECT_EQ(look_until(995), -1);
  EXPECT_EQ(said_, "");
  EXPECT_EQ(look_until(1000), -1);
  EXPECT_EQ(said_, "W waiting for: server of run 00000000000001f4 (silent for 1.0 s) (7 s left)\n");
  EXPECT_EQ(look_until(20'000), 8000);
  EXPECT_EQ(watch_->end().outcome, "lost");
  EXPECT_EQ(watch_->end().interruption,
            "the server of run 00000000000001f4 (silent for 8.0 s), given up after 7 s");
  EXPECT_FALSE(watch_->end().replacement);
}

TEST_F(RunWatchTest, AReplacementOfASilentServerEndsTheRecordingAfterASecond) {
  EXPECT_EQ(look_until(1500), -1);
  serve(kRun + 1, kReplacement, 1500, RunPhase::PHASE_WAITING);
  EXPECT_EQ(look_until(9000), 3005) << "silent from 2000 on, then 1 s for what is on its way";
  EXPECT_EQ(said_, "W run 00000000000001f4 was replaced by run 00000000000001f5\n");
  EXPECT_EQ(watch_->end().outcome, "lost");
  EXPECT_FALSE(watch_->end().is_reset);
  ASSERT_TRUE(watch_->end().replacement);
  EXPECT_EQ(watch_->end().replacement->server, kReplacement);
}

TEST_F(RunWatchTest, ANewRunOfTheSameServerIsAReset) {
  EXPECT_EQ(look_until(1500), -1);
  serve(kRun + 1, kServer, 1500, kRunning);
  EXPECT_EQ(look_until(9000), 2505);
  EXPECT_TRUE(watch_->end().is_reset);
  EXPECT_EQ(watch_->end().outcome, "reset");
  EXPECT_FALSE(watch_->end().replacement);
}

TEST_F(RunWatchTest, ARunThatManyResetsHaveMadeForgottenWasReset) {
  EXPECT_EQ(look_until(500), -1);
  for (std::uint64_t i = 1; i <= Servers::kMostRuns; ++i) serve(kRun + i, kServer, 500, kRunning);
  EXPECT_EQ(look_until(9000), 2000) << "silent from 1000 on, then 1 s for what is on its way";
  EXPECT_TRUE(watch_->end().is_reset);
}

TEST_F(RunWatchTest, AnnouncesWhenItIsReadyWithNewStepsAndEveryHalfSecond) {
  const auto due = [&](std::int64_t ms, std::int64_t step, bool hears = true) {
    return watch_->is_announcement_due({at(ms), "", hears, step});
  };
  EXPECT_FALSE(due(5, -1, false));
  EXPECT_FALSE(watch_->is_ready());
  EXPECT_TRUE(due(10, -1)) << "now it hears the server";
  EXPECT_TRUE(watch_->is_ready());
  EXPECT_FALSE(due(29, 3)) << "a few steps wait 20 ms";
  EXPECT_TRUE(due(30, 3));
  EXPECT_FALSE(due(35, 502));
  EXPECT_TRUE(due(36, 503)) << "500 steps do not wait";
  EXPECT_FALSE(due(535, 503));
  EXPECT_TRUE(due(536, 503)) << "half a second";
  EXPECT_FALSE(due(540, 503, false));
  EXPECT_TRUE(watch_->is_ready()) << "once ready it stays so";
}

}  // namespace
}  // namespace sls::record
