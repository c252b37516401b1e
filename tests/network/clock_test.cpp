/// Hosts with clocks that are wrong by an hour, set with Debian's libfaketime. Only the wall clock
/// is wrong, as on a real host.
#include <gtest/gtest.h>

#include "tests/network/hosts_flight.hpp"
#include "tests/support/faketime.hpp"

namespace sls::test {
namespace {

class ClockTest : public testing::Test {
 protected:
  void SetUp() override {
    if (const auto obstacle = Network::find_obstacle()) GTEST_SKIP() << *obstacle;
    if (find_faketime().empty()) GTEST_SKIP() << kNoFaketime;
    network_ = std::make_unique<Network>(kHosts);
  }

  void TearDown() override { remove_faketime_files(); }

  void shift(FlightOptions& options, const std::string& program, const std::string& offset) const {
    auto& before = options.before.at(program);
    const auto words = make_clock_words("FAKETIME=" + offset);
    before.insert(before.end(), words.begin(), words.end());
  }

  std::unique_ptr<Network> network_;
};

TEST_F(ClockTest, InLockstepItDoesNotMatter) {
  const Profile profile(*network_, "lan");
  FlightOptions options = profile.flight_options();
  shift(options, "control_client", "+3600s");
  shift(options, "recorder", "-3600s");
  Flight local(scenario("short")), flight(scenario("short"), options);
  local.expect_success();
  flight.expect_success();
  EXPECT_TRUE(read_figures(flight.recording(), local.recording()).is_identical);
}

class RealtimeClockTest : public ClockTest, public testing::WithParamInterface<const char*> {};

// The LIFESPAN of commands compares the clocks of two machines: it would drop every command of a
// client with a slow clock, without a message.
TEST_P(RealtimeClockTest, InRealTimeTheUserIsToldAndCommandsStillArrive) {
  const Profile profile(*network_, "lan");
  FlightOptions options = profile.flight_options();
  options.server = {"--mode", "realtime"};
  const std::string offset = GetParam();
  shift(options, "control_client", offset);
  Flight flight(scenario("short"), options);
  flight.expect_success();
  const std::string expected = offset[0] == '-' ? " s behind ours" : " s ahead of ours";
  EXPECT_NE(flight.server->output().find("the clock of controller 'control_client' on "),
            std::string::npos)
      << flight.server->output();
  EXPECT_NE(flight.server->output().find(expected), std::string::npos) << flight.server->output();
  // If no command arrived, fail_safe would count all 500 steps; on a busy machine it may count
  // some.
  const Table status(flight.recording() / "status.csv");
  EXPECT_LT(status.number(status.rows() - 1, "fail_safe"), 250) << flight.server->output();
}

INSTANTIATE_TEST_SUITE_P(AnHour, RealtimeClockTest, testing::Values("-3600s", "+3600s"),
                         [](const auto& test) {
                           return std::string(test.param[0] == '-' ? "Behind" : "Ahead");
                         });

}  // namespace
}  // namespace sls::test
