#include "common/app/wait.hpp"

#include <gtest/gtest.h>

namespace sls::app {
namespace {

TEST(WaitTest, IsOverWhenItsTimeIs) {
  EXPECT_TRUE(Wait(0.0).is_over());
  EXPECT_TRUE(Wait(-1.0).is_over());
  const Wait wait(1000.0);
  EXPECT_FALSE(wait.is_over());
  EXPECT_LE(wait.seconds_left(), 1000.0);
  EXPECT_GT(wait.seconds_left(), 900.0);  // no machine is that slow
}

TEST(WaitTest, AShortWaitIsNotReported) {
  Wait wait(1000.0);
  EXPECT_FALSE(wait.is_report_due());
}

TEST(WaitTest, TheLongestTimeoutOfAScenarioIsNotOverAtOnce) { EXPECT_FALSE(Wait(1e6).is_over()); }

}  // namespace
}  // namespace sls::app
