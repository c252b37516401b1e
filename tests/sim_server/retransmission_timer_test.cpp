#include "sim_server/retransmission_timer.hpp"

#include <gtest/gtest.h>

namespace sls::sim {
namespace {

using namespace std::chrono_literals;

/// A timer that has seen many equal round trips.
RetransmissionTimer make_settled(RetransmissionTimer::Duration round_trip) {
  RetransmissionTimer timer;
  for (int i = 0; i < 200; ++i) timer.answered(round_trip);
  return timer;
}

TEST(RetransmissionTimerTest, WaitsLongerThanAnyLocalRoundTripBeforeOneIsKnown) {
  const RetransmissionTimer timer;
  EXPECT_GE(timer.timeout(), 5ms);
  EXPECT_LE(timer.timeout(), 100ms);
}

TEST(RetransmissionTimerTest, WaitsFourTimesTheRoundTrip) {
  EXPECT_EQ(make_settled(2ms).timeout(), 8ms);
  EXPECT_EQ(make_settled(5ms).timeout(), 20ms);
}

TEST(RetransmissionTimerTest, TheFirstRoundTripCountsWhole) {
  RetransmissionTimer timer;
  timer.answered(3ms);
  EXPECT_EQ(timer.timeout(), 12ms);
}

TEST(RetransmissionTimerTest, FollowsTheRoundTripSmoothly) {
  RetransmissionTimer timer = make_settled(2ms);
  timer.answered(10ms);  // one outlier
  EXPECT_GT(timer.timeout(), 8ms);
  EXPECT_LT(timer.timeout(), 20ms);
  for (int i = 0; i < 100; ++i) timer.answered(10ms);
  EXPECT_NEAR(static_cast<double>(timer.timeout().count()), 40e6, 0.4e6);  // within 1 % of 40 ms
}

TEST(RetransmissionTimerTest, NeverWaitsLessThanTheFloor) {
  EXPECT_EQ(make_settled(30us).timeout(), RetransmissionTimer::kShortest);
  EXPECT_EQ(make_settled(1ns).timeout(), RetransmissionTimer::kShortest);
}

TEST(RetransmissionTimerTest, NeverWaitsMoreThanAHundredMilliseconds) {
  EXPECT_EQ(make_settled(70ms).timeout(), 100ms);
  EXPECT_EQ(make_settled(24h).timeout(), 100ms);
}

TEST(RetransmissionTimerTest, DoublesWithEveryResendUpToAHundredMilliseconds) {
  RetransmissionTimer timer = make_settled(2ms);
  for (const auto expected : {8ms, 16ms, 32ms, 64ms, 100ms, 100ms}) {
    EXPECT_EQ(timer.timeout(), expected);
    timer.resent();
  }
  for (int i = 0; i < 100000; ++i) timer.resent();
  EXPECT_EQ(timer.timeout(), 100ms);
}

TEST(RetransmissionTimerTest, AnAnswerToAStateSentOnceEndsTheDoubling) {
  RetransmissionTimer timer = make_settled(2ms);
  for (int i = 0; i < 5; ++i) timer.resent();
  timer.answered(90ms);
  timer.answered(2ms);
  EXPECT_EQ(timer.timeout(), 8ms);
}

TEST(RetransmissionTimerTest, ARoundTripWithAResendIsNotMeasured) {
  RetransmissionTimer timer = make_settled(2ms);
  for (int i = 0; i < 50; ++i) {
    timer.resent();
    timer.answered(95ms);  // of which copy?
  }
  timer.answered(2ms);
  EXPECT_EQ(timer.timeout(), 8ms);
}

// Karn's other rule: without it a link that has become slower than the timeout is never measured
// again, and every state of the rest of the run is sent several times.
TEST(RetransmissionTimerTest, LearnsARoundTripThatHasGrownBeyondTheTimeout) {
  RetransmissionTimer timer = make_settled(100us);
  ASSERT_EQ(timer.timeout(), 1ms);
  const auto round_trip = 10ms;
  int resends_at_last = 0;
  for (int step = 0; step < 200; ++step) {
    RetransmissionTimer::Duration waited = timer.timeout();
    resends_at_last = 0;
    while (waited < round_trip) {
      timer.resent();
      ++resends_at_last;
      waited += timer.timeout();
    }
    timer.answered(round_trip);
  }
  EXPECT_EQ(resends_at_last, 0);
  EXPECT_EQ(timer.timeout() / 1ms, 39);  // 40 ms, approached from below
}

}  // namespace
}  // namespace sls::sim
