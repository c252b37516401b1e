#include "tests/network/hosts_flight.hpp"

#include <gtest/gtest.h>

#include <csignal>

namespace sls::test {

Figures HostsTest::expect_same(const std::string& profile, const std::string& file) const {
  const Profile configured(*network_, profile);
  Flight flight(file, configured.flight_options());
  return test::expect_same(flight, file);
}

Profile::Profile(const Network& network, const std::string& name) : network_(network) {
  if (name == "unicast" || name == "wifi" || name == "secure") {
    std::string peers;
    for (const char* host : {"server", "controller", "recorder"})
      peers += (peers.empty() ? "" : ",") + network.address(host);
    environment_ = {"SLS_PEERS=" + peers};
  }
  if (name == "discovery_server") {
    const std::string& address = network.address("directory");
    environment_.push_back("SLS_DISCOVERY_SERVER=" + address);
    discovery_server_ = std::make_unique<Process>(
        network.on("directory") +
        Words{SLS_SOURCE_DIR "/sls", "discovery-server", "--listen", address});
  } else if (name == "secure") {
    const std::string keys = folder_ / "keys";
    expect_exit({SLS_SOURCE_DIR "/config/security/keys.sh", keys});
    environment_.push_back("SLS_KEYS=" + keys);
  }
  options_.qos_file = qos(name);
  options_.before["sim_server"] = before("server");
  options_.before["control_client"] = before("controller");
  options_.before["recorder"] = before("recorder");
}

Profile::~Profile() {
  if (!discovery_server_) return;
  discovery_server_->send(SIGINT);  // other signals leave its shared memory behind
  discovery_server_->wait(std::chrono::seconds(10));
}

std::vector<std::string> Profile::before(const std::string& host) const {
  return network_.on(host) + Words{"env"} + environment_;
}

Figures read_figures(const std::filesystem::path& recording, const std::filesystem::path& local) {
  Figures figures;
  const Table status(recording / "status.csv");
  if (status.rows() == 0) throw std::runtime_error(recording.string() + ": no status");
  const std::size_t last = status.rows() - 1;
  const double period_s = read_manifest(recording).at("period_s").get<double>();
  const double steps = status.number(last, "step");
  figures.wall_s = steps * period_s / status.number(last, "real_time_factor");
  figures.steps_per_s = steps / figures.wall_s;
  figures.round_trip_p50_us = status.number(last, "round_trip_p50_us");
  figures.round_trip_p99_us = status.number(last, "round_trip_p99_us");
  figures.resent = static_cast<std::uint64_t>(status.number(last, "resent"));
  for (const auto& gap : read_manifest(recording).at("missing"))
    figures.rows_lost +=
        gap.at("to").get<std::uint64_t>() - gap.at("from").get<std::uint64_t>() + 1;
  figures.is_identical = true;
  for (const char* file : {"state.csv", "reference.csv"})
    figures.is_identical &= read_file(recording / file) == read_file(local / file);
  Process verify({program("sls_verify"), recording.string(), local.string()});
  figures.is_identical &= verify.wait() == 0;
  return figures;
}

Figures expect_same(Flight& flight, const std::string& scenario_file,
                    const std::vector<std::string>& flags) {
  flight.expect_success();
  const auto alone = fly_in_process(scenario_file, flight.folder / "alone", flags);
  if (testing::Test::HasFailure()) return {};
  const Figures figures = read_figures(flight.recording(), alone);
  EXPECT_TRUE(figures.is_identical) << flight.outputs();
  EXPECT_EQ(figures.rows_lost, 0u);
  return figures;
}

}  // namespace sls::test
