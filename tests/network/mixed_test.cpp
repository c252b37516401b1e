/// Flights of this build with programs of another Debian, which have another Fast DDS: the
/// recording equals that of one machine, byte by byte. The environment names the other one:
///   SLS_OTHER_TREE   its root folder
///   SLS_OTHER_BUILD  a build of this checkout in it
/// `./sls systems` sets both.
#include <gtest/gtest.h>

#include <cstdlib>

#include "tests/network/hosts_flight.hpp"

namespace sls::test {
namespace {

const char* find_other(const char* variable) {
  const char* value = std::getenv(variable);
  return value && *value ? value : nullptr;
}

/// `before` of a program, so that it is the other system's.
std::vector<std::string> in_other(const std::vector<std::string>& before = {}) {
  return before +
         std::vector<std::string>{std::string(SLS_SOURCE_DIR) + "/tests/network/in_tree.sh",
                                  find_other("SLS_OTHER_TREE"), find_other("SLS_OTHER_BUILD")};
}

/// The programs of a flight that are the other system's.
using Others = std::vector<std::string>;

std::string name_of(const testing::TestParamInfo<Others>& info) {
  return info.param.size() == 1 ? "ServerOfTheOther" : "ClientAndRecorderOfTheOther";
}

class MixedTest : public testing::TestWithParam<Others> {
 protected:
  void SetUp() override {
    if (!find_other("SLS_OTHER_TREE") || !find_other("SLS_OTHER_BUILD"))
      GTEST_SKIP() << "no SLS_OTHER_TREE and SLS_OTHER_BUILD (./sls systems sets them)";
  }

  /// `options` with the programs of the other system.
  FlightOptions mix(FlightOptions options) const {
    for (const std::string& program : GetParam())
      options.before[program] = in_other(options.before[program]);
    return options;
  }

  /// Options of a flight on this machine without shared memory, which two versions of Fast DDS do
  /// not share.
  FlightOptions mix_here(FlightOptions options = {}) const {
    options.qos_file = qos("udp");
    return mix(options);
  }
};

TEST_P(MixedTest, OnOneMachineTheBytesAreTheSame) {
  Flight flight(scenario("figure_eight"), mix_here());
  expect_same(flight, scenario("figure_eight"));
}

TEST_P(MixedTest, AFleetIsTheSame) {
  Flight flight(scenario("mixed_fleet"), mix_here());
  expect_same(flight, scenario("mixed_fleet"));
}

TEST_P(MixedTest, RealTimeLosesNothing) {
  Flight flight(scenario("short"), mix_here({{}, {"--mode", "realtime", "--rtf", "0.5"}, {}}));
  flight.expect_success();
  ASSERT_FALSE(HasFailure());
  EXPECT_EQ(read_manifest(flight.recording()).at("missing").size(), 0u);
  Process verify({program("sls_verify"), flight.recording().string()});
  EXPECT_EQ(verify.wait(), 0) << verify.output();
}

TEST_P(MixedTest, AStandbyOfTheOtherSystemTakesOver) {
  Flight flight(scenario("figure_eight"),
                mix_here({{}, kManySteps, {"--name", "primary", "--strength", "2"}}));
  auto command = make_command(
      "control_client", flight.domain.number(),
      {"--scenario", scenario("figure_eight"), "--name", "standby", "--strength", "1"}, qos("udp"));
  const bool is_primary_other = GetParam().size() > 1;
  Process standby(is_primary_other ? command : in_other() + command);
  ASSERT_TRUE(flight.wait_for_steps(500)) << flight.outputs() << standby.output();
  flight.client->kill();
  EXPECT_EQ(flight.server->wait(), 0) << flight.outputs();
  EXPECT_EQ(flight.recorder->wait(), 0) << flight.outputs();
  EXPECT_EQ(standby.wait(), 0) << standby.output();
  ASSERT_FALSE(HasFailure());
  expect_undisturbed(flight.recording(), scenario("figure_eight"), kManySteps);
  const Table commands(flight.recording() / "command.csv");
  EXPECT_EQ(commands.text(commands.rows() - 1, "controller"), "standby");
}

TEST_P(MixedTest, EachVerifiesTheRecordingOfTheOther) {
  Flight flight(scenario("short"), mix_here());
  flight.expect_success();
  ASSERT_FALSE(HasFailure());
  const std::vector<std::string> verify = {program("sls_verify"), flight.recording().string()};
  for (const auto& command : {verify, in_other() + verify}) {
    Process process(command);
    EXPECT_EQ(process.wait(), 0) << process.output();
  }
}

TEST_P(MixedTest, WithTheDefaultProfileTheyUseTheNetworkOfTheMachine) {
  Flight flight(scenario("short"), mix({}));
  expect_same(flight, scenario("short"));
}

/// The same on hosts of their own.
class MixedNetworkTest : public MixedTest {
 protected:
  void SetUp() override {
    MixedTest::SetUp();
    if (IsSkipped()) return;
    if (const auto obstacle = Network::find_obstacle()) GTEST_SKIP() << *obstacle;
    network_ = std::make_unique<Network>(kHosts);
  }

  void fly(const std::string& profile) {
    const std::string file = scenario("short");
    const Profile configured(*network_, profile);
    Flight flight(file, mix(configured.flight_options()));
    expect_same(flight, file);
  }

  std::unique_ptr<Network> network_;
};

TEST_P(MixedNetworkTest, OnALan) { fly("lan"); }

TEST_P(MixedNetworkTest, OnALinkThatLosesFivePercent) {
  network_->lose(0.05);
  fly("lan");
  EXPECT_GT(network_->lost(), 50u);
}

// Fast DDS 2.9 and 2.11 announce themselves alike, 2.13 and later in another way (trap 38).
TEST_P(MixedNetworkTest, ASecuredFlightIsRefusedByBothSidesOrTheSame) {
  const Profile configured(*network_, "secure");
  Flight flight(scenario("short"), mix(configured.flight_options()));
  const std::string defect = ": expected one version in a secured flight\n";
  const auto is_refused = [&] {
    for (const auto* program : {&flight.server, &flight.client, &flight.recorder})
      if ((*program)->output().find(defect) == std::string::npos) return false;
    return true;
  };
  EXPECT_TRUE(wait_until([&] { return is_refused() || !flight.server->is_running(); }))
      << flight.outputs();
  if (!is_refused()) expect_same(flight, scenario("short"));
}

TEST_P(MixedNetworkTest, WithADiscoveryServer) {
  if (Process({"sh", "-c", "command -v fast-discovery-server"}).wait() != 0)
    GTEST_SKIP() << "no fast-discovery-server (Debian package fastdds-tools)";
  network_->block_multicast();
  fly("discovery_server");
}

const auto kBothWays = testing::Values(Others{"sim_server"}, Others{"control_client", "recorder"});
INSTANTIATE_TEST_SUITE_P(BothWays, MixedTest, kBothWays, name_of);
INSTANTIATE_TEST_SUITE_P(BothWays, MixedNetworkTest, kBothWays, name_of);

}  // namespace
}  // namespace sls::test
