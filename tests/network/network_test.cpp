/// The three programs on three hosts: the recording is the one of a single machine.
#include "tests/network/network.hpp"

#include <gtest/gtest.h>

#include "tests/system/flight.hpp"

namespace sls::test {
namespace {

class NetworkTest : public testing::Test {
 protected:
  void SetUp() override {
    if (const auto obstacle = Network::find_obstacle()) GTEST_SKIP() << *obstacle;
  }
};

FlightOptions spread(const Network& network, const std::string& qos_file) {
  FlightOptions options;
  options.qos_file = qos_file;
  options.before["sim_server"] = network.on("server");
  options.before["control_client"] = network.on("controller");
  options.before["recorder"] = network.on("recorder");
  return options;
}

TEST_F(NetworkTest, ThreeHostsOnALanRecordTheBytesOfOneMachine) {
  Flight local(scenario("short"));
  local.expect_success();
  const Network network({"server", "controller", "recorder"});
  Flight flight(scenario("short"), spread(network, qos("lan")));
  flight.expect_success();
  for (const char* file : {"state.csv", "reference.csv"})
    EXPECT_EQ(read_file(flight.recording() / file), read_file(local.recording() / file)) << file;
}

}  // namespace
}  // namespace sls::test
