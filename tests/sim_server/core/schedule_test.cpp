#include "sim_server/core/pacing/schedule.hpp"

#include <gtest/gtest.h>

namespace sls::sim {
namespace {

using namespace std::chrono_literals;
using Clock = Schedule::Clock;

const Clock::time_point kOrigin{1h};

TEST(ScheduleTest, StepsAreDueAtMultiplesOfThePeriodWithoutDrift) {
  const Schedule schedule(kOrigin, 4ms);
  EXPECT_EQ(schedule.due(0), kOrigin);
  EXPECT_EQ(schedule.due(15'000), kOrigin + 60s);
  // The period is no whole number of nanoseconds. Its error, 1/3 ns per step, must not accumulate.
  const Schedule thirds(kOrigin, std::chrono::duration<double, std::nano>(4e6 / 3.0));
  EXPECT_EQ(thirds.due(3'000'000), kOrigin + 4000s);
}

TEST(ScheduleTest, AStepClosesWhenTheNextIsDueButLeavesAQuarterPeriodForTheAnswer) {
  const Schedule schedule(kOrigin, 4ms);
  EXPECT_EQ(schedule.close(0, kOrigin), kOrigin + 4ms);
  EXPECT_EQ(schedule.close(0, kOrigin + 20ms), kOrigin + 21ms);
}

TEST(ScheduleTest, ASmallDelayIsCaughtUpAndALargeOneMovesTheSchedule) {
  Schedule schedule(kOrigin, 10ms);  // ten periods are more than 50 ms
  EXPECT_FALSE(schedule.slip(5, kOrigin + 50ms + 100ms));
  EXPECT_EQ(schedule.due(5), kOrigin + 50ms);
  EXPECT_EQ(schedule.slip(5, kOrigin + 50ms + 101ms), Clock::duration(101ms));
  EXPECT_EQ(schedule.due(5), kOrigin + 151ms);
  Schedule fast(kOrigin, 1ms);  // ten periods are less than 50 ms
  EXPECT_FALSE(fast.slip(0, kOrigin + 50ms));
  EXPECT_EQ(fast.slip(0, kOrigin + 51ms), Clock::duration(51ms));
}

TEST(ScheduleTest, APauseMovesEverythingAfterIt) {
  Schedule schedule(kOrigin, 4ms);
  schedule.pause(7s);
  EXPECT_EQ(schedule.due(2), kOrigin + 7s + 8ms);
}

}  // namespace
}  // namespace sls::sim
