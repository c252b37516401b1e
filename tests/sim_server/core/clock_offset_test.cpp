#include "sim_server/core/pacing/client_clocks.hpp"

#include <gtest/gtest.h>

namespace sls::sim {
namespace {

using namespace std::chrono_literals;

/// A client whose clock is ahead of the server's, answering 100 times a second.
class ClockOffsetTest : public testing::Test {
 protected:
  struct Way {
    std::chrono::nanoseconds there, computing, back;
  };
  void answer(const Way& way, int times = 1) {
    for (int i = 0; i < times; ++i, now_ += 10ms) {
      const auto written = now_ + way.there + way.computing;
      clock_.note({now_, way.computing, written + ahead_, written + way.back});
    }
  }
  static constexpr int kSecond = 100;

  ClockOffset clock_;
  std::chrono::nanoseconds ahead_{0};
  ClockOffset::Time now_{1'000'000h};
};

TEST_F(ClockOffsetTest, NothingIsKnownBeforeAFewAnswers) {
  EXPECT_FALSE(clock_.offset());
  answer({1ms, 0ms, 1ms}, ClockOffset::kLeastAnswers - 1);
  EXPECT_FALSE(clock_.offset());
  answer({1ms, 0ms, 1ms});
  EXPECT_EQ(clock_.offset(), 0ns);
}

TEST_F(ClockOffsetTest, LinkDelayIsNoOffset) {
  answer({120ms, 0ms, 120ms}, kSecond);
  EXPECT_EQ(clock_.offset(), 0ns);
}

TEST_F(ClockOffsetTest, AClockAheadOrBehindIsMeasuredThroughLinkDelay) {
  for (const auto ahead : {-3600s, 3600s}) {
    clock_ = ClockOffset();
    ahead_ = ahead;
    answer({120ms, 0ms, 120ms}, kSecond);
    EXPECT_EQ(clock_.offset(), ahead_);
  }
}

TEST_F(ClockOffsetTest, ALawThatComputesForLongIsNoOffset) {
  answer({1ms, 500ms, 1ms}, kSecond);
  EXPECT_EQ(clock_.offset(), 0ns);
}

TEST_F(ClockOffsetTest, AComputingTimeBeyondTheRoundTripIsNotBelieved) {
  clock_.note({now_, 1h, now_, now_ + 10ms});
  answer({1ms, 0ms, 1ms}, ClockOffset::kLeastAnswers);
  EXPECT_LE(std::chrono::abs(*clock_.offset()), 10ms);
}

TEST_F(ClockOffsetTest, TheShortestRoundTripCounts) {
  answer({300ms, 0ms, 1ms}, kSecond / 2);  // a queue on the way there
  EXPECT_GT(*clock_.offset(), 100ms);
  answer({2ms, 0ms, 1ms});
  EXPECT_EQ(clock_.offset(), 500us) << "half the difference of the two ways";
  answer({300ms, 0ms, 1ms}, kSecond / 2);
  EXPECT_EQ(clock_.offset(), 500us);
}

TEST_F(ClockOffsetTest, AClockThatIsSetRightIsSeenWithinTwiceTheMemory) {
  ahead_ = -1s;
  answer({1ms, 0ms, 1ms}, 5 * kSecond);
  EXPECT_EQ(clock_.offset(), -1s);
  ahead_ = 0s;
  answer({2ms, 0ms, 2ms}, 4 * kSecond + 2);
  EXPECT_EQ(clock_.offset(), 0s);
}

TEST_F(ClockOffsetTest, OurOwnClockMayBeSetBack) {
  answer({1ms, 0ms, 1ms}, kSecond);
  clock_.note({now_, 0ns, now_ + 1ms, now_ - 1h});  // set between state and answer
  now_ -= 1h;
  ahead_ = 1h;
  answer({1ms, 0ms, 1ms}, 5 * kSecond);
  EXPECT_EQ(clock_.offset(), 1h);
}

TEST_F(ClockOffsetTest, AnAnswerAfterALongPauseCountsAlone) {
  answer({1ms, 0ms, 1ms}, kSecond);
  now_ += 5s;
  ahead_ = 2s;
  answer({50ms, 0ms, 50ms});
  EXPECT_EQ(clock_.offset(), 2s);
}

}  // namespace
}  // namespace sls::sim
