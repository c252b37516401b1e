/// Hosts with clocks that are wrong by an hour, set with Debian's libfaketime. Only the wall clock
/// is wrong, as on a real host.
#include <gtest/gtest.h>

#include "tests/network/hosts_flight.hpp"
#include "tests/support/faketime.hpp"

namespace sls::test {
namespace {

class ClockTest : public HostsTest {
 protected:
  void SetUp() override {
    if (find_faketime().empty()) GTEST_SKIP() << kNoFaketime;
    if (!lets_programs_end()) GTEST_SKIP() << "this libfaketime hangs programs with Fast DDS";
    HostsTest::SetUp();
  }

  void TearDown() override { remove_faketime_files(); }

  /// False of libfaketime 0.9.12 with glibc 2.42.
  static bool lets_programs_end() {
    static const bool ends = [] {
      const OwnDomain domain;
      Process doctor(std::vector<std::string>{"timeout", "--signal=KILL", "20", "env"} +
                     make_clock_words("FAKETIME=+60s") +
                     make_command("sls_doctor", domain.number(), {}, qos("udp")));
      return doctor.wait(std::chrono::seconds(60)) != 128 + 9;
    }();
    return ends;
  }

  void shift(FlightOptions& options, const std::string& program, const std::string& offset) const {
    auto& before = options.before.at(program);
    before = before + make_clock_words("FAKETIME=" + offset);
  }
};

TEST_F(ClockTest, InLockstepItDoesNotMatter) {
  const Profile profile(*network_, "lan");
  FlightOptions options = profile.flight_options();
  shift(options, "control_client", "+3600s");
  shift(options, "recorder", "-3600s");
  Flight flight(scenario("short"), options);
  test::expect_same(flight, scenario("short"));
}

// The LIFESPAN of commands compares the clocks of two machines: it would drop every command of a
// client with a slow clock, without a message.
TEST_F(ClockTest, InRealTimeTheUserIsToldAndCommandsStillArrive) {
  const Profile profile(*network_, "lan");
  FlightOptions options = profile.flight_options();
  options.server = {"--mode", "realtime"};
  shift(options, "control_client", "-3600s");
  Flight flight(scenario("short"), options);
  flight.expect_success();
  const std::string said = flight.server->output();
  EXPECT_TRUE(holds(said, "the clock of controller 'control_client' on ")) << said;
  EXPECT_TRUE(holds(said, " s behind ours")) << said;
  // If no command arrived, fail_safe would count all 500 steps; on a busy machine it may count
  // some.
  const Table status(flight.recording() / "status.csv");
  EXPECT_LT(status.number(status.rows() - 1, "fail_safe"), 250) << flight.server->output();
}

}  // namespace
}  // namespace sls::test
