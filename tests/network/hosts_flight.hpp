/// A flight of the three programs on separate hosts, and its result compared with a local flight.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "tests/network/network.hpp"
#include "tests/system/flight.hpp"

namespace sls::test {

/// The hosts of a flight, in the order of `Network`'s addresses. The last is for a discovery
/// server.
inline const std::vector<std::string> kHosts = {"server", "controller", "recorder", "directory"};

/// Result of a flight.
struct Figures {
  double wall_s = 0.0;  ///< from step 0 to the end
  double steps_per_s = 0.0;
  double round_trip_p50_us = 0.0, round_trip_p99_us = 0.0;  ///< of the last 1,000 steps
  std::uint64_t resent = 0;  ///< number of states that the server sent again
  std::uint64_t rows_lost = 0;
  bool is_identical = false;  ///< to the local flight: state.csv, reference.csv, certificate
};

/// A test on hosts; skipped where there can be none.
class HostsTest : public testing::Test {
 protected:
  explicit HostsTest(std::vector<std::string> hosts = kHosts) : hosts_(std::move(hosts)) {}

  void SetUp() override {
    if (const auto obstacle = Network::find_obstacle()) GTEST_SKIP() << *obstacle;
    network_ = std::make_unique<Network>(hosts_);
  }

  /// Flies `file` with `profile`, one program on each host, and expects the flight of one process.
  Figures expect_same(const std::string& profile,
                      const std::string& file = scenario("short")) const;

  const std::vector<std::string> hosts_;
  std::unique_ptr<Network> network_;
};

/// The profile `config/qos/NAME.xml` on hosts with the environment variables that it requires:
/// addresses of the other hosts, address of the discovery server, keys.
class Profile {
 public:
  /// Starts the discovery server if the profile needs one, and makes keys.
  Profile(const Network& network, const std::string& name);
  ~Profile();
  Profile(const Profile&) = delete;
  Profile& operator=(const Profile&) = delete;

  /// Options of a flight with one program on each host.
  FlightOptions flight_options() const { return options_; }
  /// Command prefix of a program on `host`, also for further programs.
  std::vector<std::string> before(const std::string& host) const;

 private:
  const Network& network_;
  const TemporaryFolder folder_;
  std::vector<std::string> environment_;
  FlightOptions options_;
  std::unique_ptr<Process> discovery_server_;
};

/// Reads the figures from the recording of a finished flight. @throws std::exception if there is
/// none.
Figures read_figures(const std::filesystem::path& recording, const std::filesystem::path& local);

/// Waits for the flight. Expects success, the recording of the same scenario flown in one process
/// byte by byte, and no lost row.
Figures expect_same(Flight& flight, const std::string& scenario_file,
                    const std::vector<std::string>& flags = {});

}  // namespace sls::test
