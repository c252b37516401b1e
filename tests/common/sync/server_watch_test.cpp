#include "common/sync/server_watch.hpp"

#include <gtest/gtest.h>

#include "tests/common/sync/samples.hpp"

namespace sls::sync {
namespace {

using Finding = ServerWatch::Finding;

// This process was stopped, or its machine slept: the server was not watched meanwhile.
TEST(ServerWatchTest, AGapBetweenLooksIsNoSilence) {
  ServerWatch watch(kRun, 7, at(0));
  EXPECT_EQ(watch.look(at(0), at(501)), Finding::kThere);
  EXPECT_EQ(watch.look(at(0), at(60'000)), Finding::kThere);
  for (std::int64_t ms = 60'100; ms < 61'000; ms += 100)
    EXPECT_EQ(watch.look(at(0), at(ms)), Finding::kThere);
  EXPECT_EQ(watch.look(at(0), at(61'000)), Finding::kSilent);
}

}  // namespace
}  // namespace sls::sync
