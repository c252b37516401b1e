/// What real time promises at 250 Hz, for a minute. `./sls test --slow`, on an idle machine.
#include <gtest/gtest.h>

#include <thread>

#include "tests/system/flight.hpp"
#include "tests/system/load.hpp"

namespace sls::test {
namespace {

/// The figure eight for 60 s at a real-time factor of 1.
class RealTimeMinuteTest : public ::testing::Test {
 protected:
  std::string make_minute() const {
    return make_scenario(folder_, {{"for_s: 32", "for_s: 60"}}, "figure_eight");
  }
  static std::string read_timing(const Flight& flight) {
    const std::string timing = read_manifest(flight.recording()).at("timing");
    std::printf("%s\n", timing.c_str());
    return timing;
  }
  TemporaryFolder folder_;
};

TEST_F(RealTimeMinuteTest, NoAnswerIsLateOnAnIdleMachine) {
  Flight flight(make_minute(), {{}, {"--mode", "realtime"}, {}});
  flight.expect_success();
  EXPECT_EQ(read_timing(flight).rfind("real-time, 0 of 15000 late, worst age 0 ms", 0), 0u);
}

TEST_F(RealTimeMinuteTest, WithEveryCoreBusyTheFlightIsStableAndTheLabelSaysWhatHappened) {
  const Load load(std::thread::hardware_concurrency());
  Flight flight(make_minute(), {{}, {"--mode", "realtime"}, {}});
  flight.expect_success();
  const std::string timing = read_timing(flight);
  EXPECT_NE(timing.find("real-time, "), std::string::npos) << timing;
  // From the second lap on; an undisturbed flight stays within 1.6e-3 m.
  const TrackingError error = calc_tracking_error(flight.recording(), 4000, 15000);
  std::printf("largest load position error from the second lap on: %.3g m\n", error.max.maxCoeff());
  EXPECT_LT(error.max.maxCoeff(), 0.5);
}

}  // namespace
}  // namespace sls::test
