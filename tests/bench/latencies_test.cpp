#include "bench/latencies.hpp"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

namespace sls::bench {
namespace {

TEST(LatenciesTest, PercentilesAreOfTheNearestRank) {
  Latencies latencies;
  for (int microseconds = 1000; microseconds >= 1; --microseconds)
    latencies.add(std::chrono::microseconds(microseconds));
  const auto json = latencies.to_json();
  EXPECT_EQ(json.at("count"), 1000);
  EXPECT_EQ(json.at("min_us"), 1.0);
  EXPECT_EQ(json.at("p50_us"), 500.0);
  EXPECT_EQ(json.at("p99_us"), 990.0);
  EXPECT_EQ(json.at("p999_us"), 999.0);
  EXPECT_EQ(json.at("max_us"), 1000.0);
  EXPECT_EQ(json.at("mean_us"), 500.5);
}

TEST(LatenciesTest, OneDurationIsAllOfThem) {
  Latencies latencies;
  latencies.add(std::chrono::nanoseconds(1500));
  for (const char* key : {"min_us", "p50_us", "p99_us", "p999_us", "max_us", "mean_us"})
    EXPECT_EQ(latencies.to_json().at(key), 1.5) << key;
}

TEST(LatenciesTest, SummaryOfNoLatenciesIsEmpty) {
  EXPECT_EQ(Latencies().to_json(), (nlohmann::json{{"count", 0}}));
}

}  // namespace
}  // namespace sls::bench
