// Properties that libraries of other vendors cannot check. mirrors_judged_by_foxglove.mjs checks
// values and bytes.
#include "common/ros/mirrors.hpp"

#include <gtest/gtest.h>

#include <cstring>
#include <stdexcept>

#include "common/ros/markers.hpp"
#include "tests/common/ros/made_up_flight.hpp"

namespace sls::ros {
namespace {

using test::kMadeUpVehicles;
using test::make_sample;

struct Message {
  std::size_t channel;
  std::int64_t sim_time_ns;
  std::vector<std::uint8_t> cdr;
  bool operator==(const Message& other) const {
    return channel == other.channel && sim_time_ns == other.sim_time_ns && cdr == other.cdr;
  }
};

/// Keeps the emitted messages.
struct Log {
  std::vector<Message> messages;
  Mirrors::Emit emit = [this](std::size_t channel, std::int64_t sim_time_ns, const auto& cdr) {
    messages.push_back({channel, sim_time_ns, cdr});
  };
};

std::vector<Message> mirror(std::uint64_t steps) {
  Mirrors mirrors(kMadeUpVehicles);
  Log log;
  mirrors.emit_static(log.emit);
  for (std::uint64_t step = 0; step < steps; ++step)
    for (const std::uint32_t vehicle_id : kMadeUpVehicles)
      mirrors.emit(make_sample(vehicle_id, step), log.emit);
  return log.messages;
}

TEST(MirrorsTest, TheSameSamplesGiveTheSameBytes) { EXPECT_TRUE(mirror(100) == mirror(100)); }

TEST(MirrorsTest, TheClockNeverGoesBackWhereVehiclesComeOneAfterTheOther) {
  Mirrors mirrors(kMadeUpVehicles);
  Log log;
  for (const std::uint32_t vehicle_id : kMadeUpVehicles)
    for (std::uint64_t step = 0; step < 5; ++step)
      mirrors.emit(make_sample(vehicle_id, step), log.emit);
  std::vector<std::int64_t> clock;
  for (const Message& message : log.messages)
    if (mirrors.channels()[message.channel].topic == "/clock") clock.push_back(message.sim_time_ns);
  EXPECT_EQ(clock, (std::vector<std::int64_t>{0, 4'000'000, 8'000'000, 12'000'000, 16'000'000}));
}

TEST(MirrorsTest, RefusesAVehicleThatItDoesNotKnow) {
  Mirrors mirrors(kMadeUpVehicles);
  EXPECT_THROW(mirrors.emit(make_sample(1, 0), Log().emit), std::invalid_argument);
  EXPECT_THROW(mirrors.emit(make_sample(4, 0), Log().emit), std::invalid_argument);
}

TEST(MirrorsTest, TimesBeyondThirtyTwoBitsOfNanosecondsAreSecondsAndRest) {
  Mirrors mirrors({0});
  VehicleSample sample = make_sample(0, 0);
  sample.sim_time_ns = 12'345'000'000'678;
  std::vector<std::uint8_t> clock;
  mirrors.emit(sample, [&](std::size_t channel, std::int64_t, const auto& cdr) {
    if (mirrors.channels()[channel].topic == "/clock") clock = cdr;
  });
  ASSERT_EQ(clock.size(), 12U);
  std::int32_t seconds = 0;
  std::uint32_t rest_ns = 0;
  std::memcpy(&seconds, &clock[4], 4);
  std::memcpy(&rest_ns, &clock[8], 4);
  EXPECT_EQ(seconds, 12'345);
  EXPECT_EQ(rest_ns, 678U);
}

TEST(MirrorsTest, ALongFlightLeavesATrailOfBoundedLength) {
  Trail trail;
  for (int i = 0; i < 1000; ++i) trail.add({0.1 * i, 0, 0});
  ASSERT_EQ(trail.points().size(), Trail::kMostPoints);
  EXPECT_EQ(trail.points().back().x(), 0.1 * 999);
  EXPECT_EQ(trail.points().front().x(), 0.1 * (1000 - static_cast<int>(Trail::kMostPoints)));
}

TEST(MirrorsTest, AHoveringLoadAddsNothingToItsTrail) {
  Trail trail;
  for (int i = 0; i < 1000; ++i) trail.add({0.0005 * (i % 20), 0, 0});
  EXPECT_EQ(trail.points().size(), 1U);
}

}  // namespace
}  // namespace sls::ros
