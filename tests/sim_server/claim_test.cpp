#include "sim_server/claim.hpp"

#include <gtest/gtest.h>

namespace sls::sim {
namespace {

using namespace std::chrono_literals;

TEST(ClaimTest, IsSettledAfterAQuarterSecondOnOneMachine) {
  EXPECT_FALSE(is_claim_settled(249ms, true, true));
  EXPECT_TRUE(is_claim_settled(250ms, true, true));
}

TEST(ClaimTest, WaitsForClaimsThatWereNotHeardButNotLongerThanOneSecond) {
  EXPECT_FALSE(is_claim_settled(250ms, true, false));
  EXPECT_FALSE(is_claim_settled(999ms, true, false));
  EXPECT_TRUE(is_claim_settled(1s, true, false));
}

TEST(ClaimTest, TakesOneSecondOnANetwork) {
  EXPECT_FALSE(is_claim_settled(999ms, false, true));
  EXPECT_TRUE(is_claim_settled(1s, false, true));
}

}  // namespace
}  // namespace sls::sim
