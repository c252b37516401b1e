#include "common/config/vehicle_ids.hpp"

#include <gtest/gtest.h>

#include <random>

#include "tests/support/errors.hpp"

namespace sls::config {
namespace {

using Ids = std::vector<std::uint32_t>;

std::string find_error(const std::string& text, std::size_t fleet_size = 10) {
  return sls::test::find_error<ConfigError>([&] { parse_vehicle_ids(text, fleet_size); });
}

TEST(VehicleIdsTest, ReadsIdsAndRangesSortedAndEachOnce) {
  EXPECT_EQ(parse_vehicle_ids("all", 3), (Ids{0, 1, 2}));
  EXPECT_EQ(parse_vehicle_ids("0", 1), (Ids{0}));
  EXPECT_EQ(parse_vehicle_ids("2-4", 10), (Ids{2, 3, 4}));
  EXPECT_EQ(parse_vehicle_ids("9,0-2,1-3,9-9", 10), (Ids{0, 1, 2, 3, 9}));
  EXPECT_EQ(parse_vehicle_ids("0-255", 256).size(), 256u);
}

TEST(VehicleIdsTest, RefusesEverythingElseNamingIt) {
  const std::string words = "--vehicles: expected all, or ids and ranges such as 0-9,20, got '";
  EXPECT_EQ(find_error(""), words + "'");
  EXPECT_EQ(find_error("0,"), words + "'");
  EXPECT_EQ(find_error("1,x,2"), words + "x'");
  EXPECT_EQ(find_error("5-3"), words + "5-3'");
  EXPECT_EQ(find_error("-1"), words + "-1'");
  EXPECT_EQ(find_error("1-2-3"), words + "1-2-3'");
  EXPECT_EQ(find_error("0 - 3"), words + "0 - 3'");
  EXPECT_EQ(find_error("all,1"), words + "all'");
  EXPECT_EQ(find_error("1.5"), words + "1.5'");
  EXPECT_EQ(find_error("99999999999"), words + "99999999999'");
  EXPECT_EQ(find_error("1\n2"), words + "1\\x0a2'");
}

TEST(VehicleIdsTest, RefusesVehiclesBeyondTheFleet) {
  EXPECT_EQ(find_error("0-10"), "--vehicles: expected vehicles from 0 to 9, got '0-10'");
  EXPECT_EQ(find_error("4294967295"),
            "--vehicles: expected vehicles from 0 to 9, got '4294967295'");
  EXPECT_EQ(find_error("1", 1), "--vehicles: expected 0, the scenario's only vehicle, got '1'");
}

TEST(VehicleIdsTest, WritesWhatItReads) {
  EXPECT_EQ(to_vehicle_ranges({0, 1, 2, 3, 20}), "0-3,20");
  EXPECT_EQ(to_vehicle_ranges({7}), "7");
  std::mt19937 random(5);
  for (int i = 0; i < 1000; ++i) {
    Ids ids;
    for (std::uint32_t id = 0; id < 40; ++id)
      if (random() % 3 != 0) ids.push_back(id);
    if (ids.empty()) continue;
    EXPECT_EQ(parse_vehicle_ids(to_vehicle_ranges(ids), 40), ids);
  }
}

}  // namespace
}  // namespace sls::config
