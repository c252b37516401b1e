#include "sim_server/core/pacing/retransmission_timer.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

namespace sls::sim {
namespace {

using namespace std::chrono_literals;

/// A timer that has seen many equal round trips.
RetransmissionTimer make_settled(RetransmissionTimer::Duration round_trip) {
  RetransmissionTimer timer;
  for (int i = 0; i < 200; ++i) timer.answered(round_trip, round_trip);
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
  timer.answered(3ms, 3ms);
  EXPECT_EQ(timer.timeout(), 12ms);
}

TEST(RetransmissionTimerTest, FollowsTheRoundTripSmoothly) {
  RetransmissionTimer timer = make_settled(2ms);
  timer.answered(10ms, 10ms);  // one outlier
  EXPECT_GT(timer.timeout(), 8ms);
  EXPECT_LT(timer.timeout(), 20ms);
  for (int i = 0; i < 100; ++i) timer.answered(10ms, 10ms);
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
  timer.answered(90ms, 90ms);
  timer.answered(2ms, 2ms);
  EXPECT_EQ(timer.timeout(), 8ms);
}

TEST(RetransmissionTimerTest, ARoundTripWithAResendIsNotMeasured) {
  RetransmissionTimer timer = make_settled(2ms);
  for (int i = 0; i < 50; ++i) {
    timer.resent();
    timer.answered(95ms, 95ms);  // it may answer either copy
  }
  timer.answered(2ms, 2ms);
  EXPECT_EQ(timer.timeout(), 8ms);
}

// Karn's other rule, the doubling. Without it a link that became slower than the timeout is never
// measured again, and every later state of the run is sent several times.
TEST(RetransmissionTimerTest, LearnsARoundTripThatHasGrownBeyondTheTimeout) {
  RetransmissionTimer timer = make_settled(100us);
  ASSERT_EQ(timer.timeout(), 1ms);
  const auto round_trip = 10ms;
  int resends_at_last = 0;
  for (int step = 0; step < 200; ++step) {
    RetransmissionTimer::Duration last_sent{0}, resend_at = timer.timeout();
    resends_at_last = 0;
    while (resend_at < round_trip) {
      last_sent = resend_at;
      timer.resent();
      ++resends_at_last;
      resend_at += timer.timeout();
    }
    timer.answered(round_trip, round_trip - last_sent);
  }
  EXPECT_EQ(resends_at_last, 0);
  EXPECT_EQ(timer.timeout() / 1ms, 39);  // 40 ms, approached from below
}

/// Mean time per step over a link that loses a fifth in each direction. Answers take
/// `calc_round_trip()`.
template <class RoundTrip>
RetransmissionTimer::Duration fly_with_loss(RoundTrip calc_round_trip) {
  RetransmissionTimer timer = make_settled(200us);
  std::mt19937_64 generator(1);
  std::bernoulli_distribution is_lost(1 - 0.8 * 0.8);  // the state or its answer
  RetransmissionTimer::Duration whole{0};
  constexpr int kSteps = 10000;
  for (int step = 0; step < kSteps; ++step) {
    RetransmissionTimer::Duration sent{0}, last_sent{0},
        answered = RetransmissionTimer::Duration::max();
    while (true) {
      last_sent = sent;
      if (!is_lost(generator)) answered = std::min(answered, sent + calc_round_trip(generator));
      sent += timer.timeout();
      if (answered <= sent) break;
      timer.resent();
    }
    timer.answered(answered, answered - last_sent);
    whole += answered;
  }
  return whole / kSteps;
}

// With Karn's other rule alone the timeout doubles faster than answers end the doubling: most steps
// would wait 100 ms.
TEST(RetransmissionTimerTest, ALinkThatLosesAFifthEachWayCostsMillisecondsNotTheLongestTimeout) {
  // With doubling only within a step: 0.36 · 1 ms / (1 − 0.72) + 0.2 ms = 1.5 ms. Some of the
  // doubling lasts longer.
  EXPECT_LT(fly_with_loss([](auto&) { return 200us; }), 2500us);
}

TEST(RetransmissionTimerTest, NorDoesItWhereABusyMachineAnswersUnevenly) {
  std::exponential_distribution<double> rare(1.0);
  const auto calc_round_trip = [&](auto& generator) {  // 0.2 ms and, on average, 2 ms more
    return std::chrono::nanoseconds(200'000 + static_cast<std::int64_t>(2e6 * rare(generator)));
  };
  EXPECT_LT(fly_with_loss(calc_round_trip), 25ms);
}

}  // namespace
}  // namespace sls::sim
