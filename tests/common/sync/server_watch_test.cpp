#include "common/sync/server_watch.hpp"

#include <gtest/gtest.h>

#include "tests/common/sync/samples.hpp"

namespace sls::sync {
namespace {

using Finding = ServerWatch::Finding;

/// Looks every 100 ms until `end_ms`; the server was last heard at `heard`. @returns the last
/// finding.
Finding look_until(ServerWatch& watch, std::int64_t& now_ms, std::int64_t end_ms, Time heard) {
  Finding finding{};
  for (now_ms += 100; now_ms <= end_ms; now_ms += 100) finding = watch.look(heard, at(now_ms));
  now_ms -= 100;
  return finding;
}

TEST(ServerWatchTest, ASilentServerIsReportedGivenUpAndMayComeBack) {
  ServerWatch watch(kRun, 7, at(0));
  std::int64_t now = 0;
  EXPECT_EQ(look_until(watch, now, 900, at(0)), Finding::kThere);
  EXPECT_EQ(look_until(watch, now, 1000, at(0)), Finding::kSilent);
  ASSERT_TRUE(watch.report());
  EXPECT_TRUE(watch.report()->is_warning);
  EXPECT_EQ(watch.report().value().text,
            "waiting for: server of run 00000000000001f4 (silent for 1.0 s) (7 s left)");
  look_until(watch, now, 5900, at(0));
  EXPECT_FALSE(watch.report()) << "every 5 s";
  look_until(watch, now, 6000, at(0));
  EXPECT_EQ(watch.report().value().text,
            "waiting for: server of run 00000000000001f4 (silent for 6.0 s) (2 s left)");
  EXPECT_EQ(look_until(watch, now, 7900, at(0)), Finding::kSilent);
  EXPECT_EQ(look_until(watch, now, 8000, at(0)), Finding::kLost);
  EXPECT_EQ(watch.describe(at(8000)), "server of run 00000000000001f4 (silent for 8.0 s)");

  EXPECT_EQ(look_until(watch, now, 8100, at(8050)), Finding::kThere);
  EXPECT_EQ(watch.report().value().text, "the server of run 00000000000001f4 is back");
  EXPECT_FALSE(watch.report()->is_warning);
  look_until(watch, now, 8200, at(8150));
  EXPECT_FALSE(watch.report()) << "once";
}

TEST(ServerWatchTest, AServerIsSilentAtOneSecondAndNotBefore) {
  ServerWatch watch(kRun, 7, at(0));
  EXPECT_EQ(watch.look(at(0), at(500)), Finding::kThere);
  EXPECT_EQ(watch.look(at(0), at(999)), Finding::kThere);
  EXPECT_EQ(watch.look(at(0), at(1000)), Finding::kSilent);
}

// This process was stopped, or its machine slept: the server was not watched meanwhile.
TEST(ServerWatchTest, AGapBetweenLooksIsNoSilence) {
  ServerWatch watch(kRun, 7, at(0));
  EXPECT_EQ(watch.look(at(0), at(501)), Finding::kThere);
  EXPECT_EQ(watch.look(at(0), at(60'000)), Finding::kThere);
  std::int64_t now = 60'000;
  EXPECT_EQ(look_until(watch, now, 60'900, at(0)), Finding::kThere);
  EXPECT_EQ(look_until(watch, now, 61'000, at(0)), Finding::kSilent);
}

}  // namespace
}  // namespace sls::sync
