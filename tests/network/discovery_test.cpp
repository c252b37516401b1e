/// A network without multicast: two profiles work, and with the third the programs name the cause.
#include <gtest/gtest.h>

#include "tests/network/hosts_flight.hpp"

namespace sls::test {
namespace {

class NoMulticastTest : public testing::Test {
 protected:
  void SetUp() override {
    if (const auto obstacle = Network::find_obstacle()) GTEST_SKIP() << *obstacle;
    network_ = std::make_unique<Network>(kHosts);
    network_->block_multicast();
  }

  void expect_same(const std::string& profile) {
    const Profile configured(*network_, profile);
    Flight flight(scenario("short"), configured.flight_options());
    test::expect_same(flight, scenario("short"));
  }

  std::unique_ptr<Network> network_;
};

TEST_F(NoMulticastTest, InitialPeersFindEachOther) { expect_same("unicast"); }

TEST_F(NoMulticastTest, ADiscoveryServerBringsThemTogether) {
  if (Process({"sh", "-c", "command -v fast-discovery-server"}).wait() != 0)
    GTEST_SKIP() << "no fast-discovery-server (Debian package fastdds-tools)";
  expect_same("discovery_server");
}

/// The scenario `short` with the time limit `timeout_s` for the start.
std::string make_impatient_scenario(const TemporaryFolder& folder, int timeout_s) {
  return make_scenario(folder, {{"timeout_s: 30", "timeout_s: " + std::to_string(timeout_s)}});
}

TEST_F(NoMulticastTest, WithLanEachProgramNamesTheMissingOneAndSuggestsMulticast) {
  const TemporaryFolder folder;
  const Profile profile(*network_, "lan");
  Flight flight(make_impatient_scenario(folder, 5), profile.flight_options());
  const auto says = [](const Process& process, const std::string& missing) {
    return wait_until([&] {
      const std::string said = process.output();
      return said.find(missing) != said.npos && said.find("is multicast blocked?") != said.npos &&
             said.find("config/qos/unicast.xml") != said.npos;
    });
  };
  EXPECT_EQ(flight.server->wait(), 1);
  EXPECT_TRUE(says(*flight.server, "not ready within 5 s: controller, recorder"))
      << flight.server->output();
  EXPECT_EQ(flight.client->wait(), 1);
  EXPECT_TRUE(says(*flight.client, "no server for vehicle 0 within 5 s"))
      << flight.client->output();
  // A recorder waits for a minute; it prints earlier that it waits for a server.
  EXPECT_TRUE(says(*flight.recorder, "waiting for: server")) << flight.recorder->output();
}

TEST_F(NoMulticastTest, ADiscoveryServerThatIsNotThereIsNamed) {
  const TemporaryFolder folder;
  auto before = network_->on("controller");
  const std::string address = network_->address("directory");
  before.insert(before.end(), {"env", "SLS_DISCOVERY_SERVER=" + address});
  auto command =
      make_command("control_client", 0, {"--scenario", make_impatient_scenario(folder, 4)},
                   qos("discovery_server"));
  command.insert(command.begin(), before.begin(), before.end());
  Process client(command);
  EXPECT_EQ(client.wait(), 1);
  EXPECT_NE(client.output().find("no server for vehicle 0 within 4 s; the discovery server at " +
                                 address + " does not answer"),
            std::string::npos)
      << client.output();
}

}  // namespace
}  // namespace sls::test
