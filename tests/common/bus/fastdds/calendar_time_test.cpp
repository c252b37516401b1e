// Tests common/bus/fastdds/calendar_time.cpp, which this program links.
#include <gtest/gtest.h>

#include <ctime>
#include <limits>
#include <thread>
#include <vector>

namespace {

/// By another function of the C library: the seconds of a date.
void expect_date(std::time_t time) {
  tm date{};
  ASSERT_EQ(gmtime_r(&time, &date), &date);
  tm again = date;
  EXPECT_EQ(timegm(&again), time);
  EXPECT_EQ(again.tm_wday, date.tm_wday);
  EXPECT_EQ(again.tm_yday, date.tm_yday);
  EXPECT_EQ(date.tm_gmtoff, 0);
}

TEST(CalendarTimeTest, GivesTheDateOfEachSecondOnceAndAgain) {
  for (const std::time_t time : {0L, 0L, 1L, 951'782'400L, 951'782'400L, 951'868'799L, -1L, -1L,
                                 1'800'000'000L, 1'799'999'999L, 0L})
    expect_date(time);
}

TEST(CalendarTimeTest, ThreadsHaveDatesOfTheirOwn) {
  std::vector<std::thread> threads;
  for (std::time_t first = 0; first < 4; ++first)
    threads.emplace_back([first] {
      for (std::time_t i = 0; i < 1'000'000'000; i += 12'345'678) expect_date(first + i);
    });
  for (std::thread& thread : threads) thread.join();
}

TEST(CalendarTimeTest, GivesNothingForATimeWithoutADateAndGoesOn) {
  const std::time_t time = std::numeric_limits<std::time_t>::max();
  tm date{};
  EXPECT_EQ(gmtime_r(&time, &date), nullptr);
  expect_date(1);
}

}  // namespace
