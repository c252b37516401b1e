#include "common/app/awake_clock.hpp"

#include <gtest/gtest.h>

#include <thread>
#include <vector>

namespace sls::app {
namespace {

sync::Time at(std::int64_t ms) {
  return sync::Time(std::chrono::hours(1) + std::chrono::milliseconds(ms));
}

TEST(AwakeClockTest, WithoutAnExpectedLookItIsTheSteadyClock) {
  AwakeClock clock;
  EXPECT_EQ(clock.look(at(0)), at(0));
  EXPECT_EQ(clock.look(at(3'600'000)), at(3'600'000));
}

TEST(AwakeClockTest, ALateLookMeansAStopSinceTheOneBefore) {
  AwakeClock clock;
  clock.look(at(0));
  clock.expect_look(at(20));
  EXPECT_EQ(clock.look(at(220)), at(220)) << "late, but that is the scheduler";
  clock.expect_look(at(240));
  EXPECT_EQ(clock.look(at(441)), at(220)) << "so no deadline has passed since";
  EXPECT_EQ(clock.stopped(), std::chrono::milliseconds(221));
  EXPECT_EQ(clock.look(at(541)), at(320)) << "the main thread has 200 ms to look again";
  EXPECT_EQ(clock.look(at(742)), at(320));
}

TEST(AwakeClockTest, WaitsEndInSteadyTime) {
  AwakeClock clock;
  clock.look(at(0));
  clock.expect_look(at(10));
  clock.look(at(5000));
  EXPECT_EQ(clock.to_steady(at(10)), at(5010));
  clock.expect_look(at(10));
  EXPECT_EQ(clock.look(at(5010)), at(10));
}

TEST(AwakeClockTest, ManyThreadsCountAStopOnceAndTimeNeverGoesBack) {
  AwakeClock clock;
  clock.now();
  clock.expect_look(clock.now() - std::chrono::milliseconds(199));
  std::atomic<int> went_back{0};
  std::vector<std::thread> threads;
  for (int i = 0; i < 4; ++i)
    threads.emplace_back([&] {
      sync::Time last = clock.now();
      const sync::Time end = std::chrono::steady_clock::now() + std::chrono::milliseconds(300);
      while (std::chrono::steady_clock::now() < end) {
        const sync::Time now = clock.now();
        if (now < last) ++went_back;
        last = now;
      }
    });
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(went_back, 0);
  EXPECT_LT(clock.stopped(), std::chrono::milliseconds(300)) << "the threads looked all the time";
}

}  // namespace
}  // namespace sls::app
