/// A network without multicast: two profiles work, and with the third the programs name the cause.
#include <gtest/gtest.h>

#include "tests/network/hosts_flight.hpp"

namespace sls::test {
namespace {

class NoMulticastTest : public HostsTest {
 protected:
  void SetUp() override {
    HostsTest::SetUp();
    if (network_) network_->block_multicast();
  }
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
  const std::string address = network_->address("directory");
  const std::string said = expect_exit(
      network_->on("controller") + Words{"env", "SLS_DISCOVERY_SERVER=" + address} +
          make_command("control_client", 0, {"--scenario", make_impatient_scenario(folder, 4)},
                       qos("discovery_server")),
      1);
  EXPECT_TRUE(holds(said, "no server for vehicle 0 within 4 s; the discovery server at " + address +
                              " does not answer"))
      << said;
}

}  // namespace
}  // namespace sls::test
