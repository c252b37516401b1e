/// The three programs on three hosts with network disturbances: the recording equals that of a
/// single machine, byte by byte.
#include <gtest/gtest.h>

#include <chrono>
#include <regex>
#include <thread>

#include "tests/network/hosts_flight.hpp"

namespace sls::test {
namespace {

using namespace std::chrono_literals;

class NetworkTest : public HostsTest {};

TEST_F(NetworkTest, ALinkThatLosesTwentyPercent) {
  network_->lose(0.2);
  // Fast DDS repeats lost discovery data once a second: half a minute is not always enough.
  const TemporaryFolder folder;
  expect_same("wifi", make_scenario(folder, {{"timeout_s: 30", "timeout_s: 120"}}));
  EXPECT_GT(network_->lost(), 200u);
}

TEST_F(NetworkTest, WiresWithDelayAndJitterWherePacketsComeTwiceAndOutOfOrder) {
  network_->disturb_wire("controller", {1.0, 2.0, 0.0, 1});
  for (const char* host : {"server", "recorder"}) network_->disturb_wire(host, {0.0, 1.0, 30.0, 2});
  const Figures figures = expect_same("lan");
  EXPECT_GT(figures.round_trip_p50_us, 2000);  // delay in both directions
  for (const char* host : {"controller", "server", "recorder"}) {
    const std::string said = network_->end_wire(host);
    EXPECT_EQ(said.find(" 0 overtaken"), std::string::npos) << said;
    if (host != std::string("controller")) {
      EXPECT_EQ(said.find(" 0 duplicated"), std::string::npos) << said;
    }
  }
}

TEST_F(NetworkTest, ALinkOfFourMegabitsWithPacketsOfAtMost576Bytes) {
  network_->limit_rate(4000);
  network_->set_mtu(576);
  const Figures figures = expect_same("lan");
  EXPECT_LT(figures.steps_per_s, 1500);  // without the limit it is twice as fast
}

TEST_F(NetworkTest, APartitionOfFiveSecondsCostsAtMostSix) {
  const Profile profile(*network_, "lan");
  const TemporaryFolder folder;
  const std::string file = make_long_scenario(folder);
  Flight flight(file, profile.flight_options());
  ASSERT_TRUE(flight.wait_for_steps(100)) << flight.outputs();
  network_->cut();
  std::this_thread::sleep_for(5s);  // the disturbance itself, not a wait
  const std::size_t before = Table(flight.recording() / "state.csv").rows();
  network_->heal();
  ASSERT_TRUE(flight.wait_for_steps(before + 100)) << flight.outputs();
  const std::string said = flight.server->output();
  std::smatch stood;
  ASSERT_TRUE(std::regex_search(said, stood, std::regex("answers again after ([0-9.]+) s")))
      << said;
  test::expect_same(flight, file);
  ASSERT_LT(before + 200, Table(flight.recording() / "state.csv").rows()) << "cut too late";
  EXPECT_LT(std::stod(stood[1]), 6.0) << said;
}

TEST_F(NetworkTest, ARecorderThatComesLateHasEverything) {
  const Profile profile(*network_, "unicast");
  const Programs programs(profile.flight_options());
  const auto server = programs.start("sim_server", {"--scenario", scenario("short")});
  const auto client = programs.start("control_client", {"--scenario", scenario("short")});
  ASSERT_TRUE(wait_until([&] {
    return server->output().find("waiting for: recorder") != std::string::npos ||
           server->output().find("is not ready], recorder") != std::string::npos;
  })) << server->output();
  const auto recorder = programs.start("recorder", {"--out", programs.recording()});
  expect_success({server.get(), client.get(), recorder.get()});
  const auto alone = fly_in_process(scenario("short"), programs.folder / "alone");
  EXPECT_TRUE(read_figures(programs.recording(), alone).is_identical);
}

}  // namespace
}  // namespace sls::test
