#include "sim_server/core/report/status_series.hpp"

#include <gtest/gtest.h>

#include <string>
#include <utility>

namespace sls::sim {
namespace {

using namespace std::chrono_literals;

TEST(RoundTripsTest, IsEmptyBeforeTheFirstRoundTrip) {
  EXPECT_EQ(RoundTrips().calc_percentile(50), 0ns);
  EXPECT_EQ(RoundTrips().calc_percentile(99), 0ns);
}

TEST(RoundTripsTest, OneIsEveryPercentile) {
  RoundTrips trips;
  trips.add(7us);
  for (const int percent : {1, 50, 99, 100}) EXPECT_EQ(trips.calc_percentile(percent), 7us);
}

// The textbook's example of the nearest-rank method.
TEST(RoundTripsTest, PercentilesAreThoseOfTheNearestRank) {
  RoundTrips trips;
  for (const auto value : {20ns, 15ns, 50ns, 35ns, 40ns}) trips.add(value);
  EXPECT_EQ(trips.calc_percentile(5), 15ns);
  EXPECT_EQ(trips.calc_percentile(30), 20ns);
  EXPECT_EQ(trips.calc_percentile(40), 20ns);
  EXPECT_EQ(trips.calc_percentile(50), 35ns);
  EXPECT_EQ(trips.calc_percentile(99), 50ns);
  EXPECT_EQ(trips.calc_percentile(100), 50ns);
}

TEST(RoundTripsTest, OnlyTheLastThousandCount) {
  RoundTrips trips;
  for (int i = 0; i < 500; ++i) trips.add(1h);
  for (int i = 1; i <= 1000; ++i) trips.add(std::chrono::nanoseconds(i));
  EXPECT_EQ(trips.calc_percentile(50), 500ns);
  EXPECT_EQ(trips.calc_percentile(99), 990ns);
  EXPECT_EQ(trips.calc_percentile(100), 1000ns);
  trips.add(5000ns);  // replaces the oldest, 1 ns
  EXPECT_EQ(trips.calc_percentile(50), 501ns);
  EXPECT_EQ(trips.calc_percentile(100), 5000ns);
}

TEST(RoundTripsTest, AskingChangesNothing) {
  RoundTrips trips;
  for (int i = 1000; i >= 1; --i) trips.add(std::chrono::nanoseconds(i));
  EXPECT_EQ(trips.calc_percentile(1), 10ns);
  trips.add(2000ns);  // replaces the oldest, 1000 ns
  EXPECT_EQ(trips.calc_percentile(100), 2000ns);
  EXPECT_EQ(trips.calc_percentile(99), 990ns);
}

TEST(StatusSeriesTest, ATextThatIsTooLongEndsWithDotsBetweenTwoLetters) {
  const std::string most(255, 'x'), letters = std::string(251, 'x') + "\xc3\xa4";  // "ä"
  StatusSeries series(1, 0, {});
  StatusSeries::Content content;
  for (const auto& [text, expected] : {std::pair(most, most),
                                       {most + "y", std::string(252, 'x') + "..."},
                                       {letters + "and more", std::string(251, 'x') + "..."}}) {
    content.reason = content.problem = text;
    const SimStatus status = series.make(content, {});
    EXPECT_EQ(status.reason().to_string(), expected);
    EXPECT_EQ(status.problem().to_string(), expected);
  }
}

}  // namespace
}  // namespace sls::sim
