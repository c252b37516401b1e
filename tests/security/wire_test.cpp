/// Data that a host without keys can read on the network, and its attacks. The network has three
/// hosts of the flight and that host.
#include <gtest/gtest.h>

#include <cstdint>
#include <cstring>

#include "tests/network/hosts_flight.hpp"
#include "tests/security/keys.hpp"

namespace sls::test {
namespace {

template <class Value>
std::string to_bytes(const Value& value) {
  std::string bytes(sizeof value, '\0');
  std::memcpy(bytes.data(), &value, sizeof value);
  return bytes;
}

class WireTest : public HostsTest {
 protected:
  WireTest() : HostsTest({"server", "controller", "recorder", "stranger"}) {}

  FlightOptions options(const std::string& profile) const {
    FlightOptions options;
    options.qos_file = qos(profile);
    options.before = {{"sim_server", network_->on("server") + keys_.as()},
                      {"control_client", network_->on("controller") + keys_.as()},
                      {"recorder", network_->on("recorder") + keys_.as()}};
    return options;
  }

  Keys keys_;
};

/// Secrets of a flight that were found in captured packets: positions of the recording, and others.
struct Heard {
  std::size_t packets_bytes = 0;
  std::size_t positions = 0;
  bool run_id = false;
  bool scenario = false;
};

Heard find_secrets(const Flight& flight, const std::string& captured) {
  Heard heard;
  heard.packets_bytes = captured.size();
  const Table states(flight.recording() / "state.csv");
  for (std::size_t row = 100; row < states.rows(); row += 100)
    for (const char* column : {"quad_x_m", "load_y_m"})
      heard.positions += captured.find(to_bytes(states.number(row, column))) != std::string::npos;
  const auto run_id =
      std::stoull(read_manifest(flight.recording()).at("run_id").get<std::string>(), nullptr, 16);
  heard.run_id = captured.find(to_bytes(static_cast<std::uint64_t>(run_id))) != std::string::npos;
  heard.scenario = captured.find("figure_eight: { amplitude_m") != std::string::npos;
  return heard;
}

TEST_F(WireTest, HoldsNoPlainTextOfASecuredFlight) {
  const auto listen = [&](const std::string& profile) {
    const TemporaryFolder folder;
    const std::string file = (folder / "packets").string();
    Process capture(network_->on(Network::kSwitch) + Words{SLS_CAPTURE, file});
    EXPECT_TRUE(wait_for_text(capture, "capturing")) << capture.output();
    Flight flight(scenario("short"), options(profile));
    flight.expect_success();
    capture.send(SIGTERM);
    EXPECT_EQ(capture.wait(), 0) << capture.output();
    return find_secrets(flight, read_bytes(file));
  };
  const Heard open = listen("lan"), secured = listen("secure");
  // Five rows (100, 200 … 500) of two columns: the open flight must show all of them, otherwise the
  // test proves nothing.
  EXPECT_EQ(open.positions, 10u);
  EXPECT_TRUE(open.run_id);
  EXPECT_TRUE(open.scenario);
  EXPECT_GT(secured.packets_bytes, open.packets_bytes / 2);
  EXPECT_EQ(secured.positions, 0u);
  EXPECT_FALSE(secured.run_id);
  EXPECT_FALSE(secured.scenario);
}

TEST_F(WireTest, WithoutMulticastASecuredFlightNeedsItsPeersNamed) {
  network_->block_multicast();
  FlightOptions secured = options("secure");
  for (auto& [program, before] : secured.before)
    before.push_back("SLS_PEERS=" + network_->address("server") + "," +
                     network_->address("controller"));
  Flight flight(scenario("short"), secured);
  flight.expect_success();
  expect_undisturbed(flight.recording(), scenario("short"));
}

TEST_F(WireTest, SamplesForgedInTheControllersNameStopAnOpenFlightAndNotASecuredOne) {
  const auto start_forger = [&](const Flight& flight) {
    return std::make_unique<Process>(network_->on("stranger") +
                                     Words{SLS_FORGER, network_->address("controller"),
                                           network_->address("server"), flight.domain.text()});
  };
  // Some 1,000 steps/s: the flight outlasts the forger, which sends for a second.
  network_->limit_rate(10000);
  {
    Flight open(scenario("figure_eight"), options("lan"));
    ASSERT_TRUE(open.wait_for_steps(300)) << open.outputs();
    const auto forger = start_forger(open);
    EXPECT_TRUE(wait_for_text(*open.server, "waiting for")) << open.outputs();
    EXPECT_EQ(forger->wait(), 0) << forger->output();
  }
  const TemporaryFolder folder;
  const std::string file = make_scenario(folder, {{"for_s: 32", "for_s: 20"}}, "figure_eight");
  Flight secured(file, options("secure"));
  ASSERT_TRUE(secured.wait_for_steps(300)) << secured.outputs();
  const auto forger = start_forger(secured);
  EXPECT_EQ(forger->wait(), 0) << forger->output();
  EXPECT_TRUE(secured.server->is_running()) << "over before the attack\n" << secured.outputs();
  secured.expect_success();
  expect_undisturbed(secured.recording(), file);
}

}  // namespace
}  // namespace sls::test
