/// ./sls network-table: flies every QoS profile through every disturbance of tests/network/ and
/// prints the effect of each as a Markdown table.
#include <gtest/gtest.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <functional>
#include <thread>

#include "tests/network/hosts_flight.hpp"

namespace {

using namespace sls::test;
using namespace std::chrono_literals;

struct Disturbance {
  std::string name;
  std::function<void(Network&)> apply;
  bool is_partition = false;
};

const std::vector<Disturbance> kDisturbances = {
    {"none", [](Network&) {}},
    {"1 % loss", [](Network& network) { network.lose(1); }},
    {"5 % loss", [](Network& network) { network.lose(5); }},
    {"20 % loss", [](Network& network) { network.lose(20); }},
    {"1–3 ms each way",
     [](Network& network) {
       network.disturb_wire("controller", {1.0, 2.0, 0.0, 1});
     }},
    {"30 % twice, reordered",
     [](Network& network) {
       network.disturb_wire("controller", {0.0, 0.5, 30.0, 1});
     }},
    {"4 Mbit/s", [](Network& network) { network.limit_rate(4000); }},
    {"MTU 576", [](Network& network) { network.set_mtu(576); }},
    {"5 s partition", [](Network&) {}, true},
    {"no multicast", [](Network& network) { network.block_multicast(); }},
};

const std::vector<std::string> kProfiles = {"lan", "unicast", "discovery_server", "wifi", "secure"};

/// The figure eight for 16 s, 4,000 steps, with a long time limit for a start over a bad link.
std::string make_scenario(const TemporaryFolder& folder, int vehicles) {
  return make_scenario(
      folder,
      {{"for_s: 32", "for_s: 16"},
       {"timeout_s: 30", "timeout_s: 120"},
       {"name: figure_eight", "name: figure_eight\nvehicles: " + std::to_string(vehicles)}},
      "figure_eight");
}

std::string format(const Figures& figures) {
  char text[200];
  std::snprintf(text, sizeof text, "%.0f | %.2f / %.1f | %llu | %llu | %s |", figures.steps_per_s,
                figures.round_trip_p50_us / 1e3, figures.round_trip_p99_us / 1e3,
                static_cast<unsigned long long>(figures.resent),
                static_cast<unsigned long long>(figures.rows_lost),
                figures.is_identical ? "yes" : "**no**");
  return text;
}

/// Columns 3 to 8 of the table: the effect of `disturbance` with `profile`.
std::string fly(const std::string& file, const std::string& profile, const Disturbance& disturbance,
                const Flight& local) {
  Network network(kHosts);
  disturbance.apply(network);
  const Profile configured(network, profile);
  Flight flight(file, configured.flight_options());
  if (disturbance.is_partition) {
    flight.wait_for_steps(1);
    network.cut();
    std::this_thread::sleep_for(5s);
    network.heal();
  }
  for (Process* process : {flight.server.get(), flight.client.get(), flight.recorder.get()})
    if (process->wait() != 0) {
      std::fprintf(stderr, "%s", flight.outputs().c_str());
      return "does not fly | | | | |";
    }
  return format(read_figures(flight.recording(), local.recording()));
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App cli(
      "Flies each QoS profile on test hosts through each network disturbance; prints\na Markdown "
      "table. Needs root and takes minutes.");
  std::vector<std::string> profiles = kProfiles, disturbances;
  int vehicles = 1;
  cli.add_option("--profile", profiles, "fly only these profiles (names in config/qos)");
  cli.add_option("--disturbance", disturbances,
                 "apply only these disturbances (names in the table)");
  cli.add_option("--vehicles", vehicles, "vehicles in each flight")->check(CLI::Range(1, 256));
  CLI11_PARSE(cli, argc, argv);
  if (const auto obstacle = Network::find_obstacle()) {
    std::fprintf(stderr, "network_table: error: %s\n", obstacle->c_str());
    return 1;
  }
  try {
    const TemporaryFolder folder;
    const std::string file = make_scenario(folder, vehicles);
    Flight local(file);
    local.expect_success();
    std::puts(
        "| profile | disturbance | steps/s | round trip p50 / p99 (ms) | resent | rows lost | "
        "identical |\n| --- | --- | --- | --- | --- | --- | --- |");
    std::printf("| `default` | one machine | %s\n",
                format(read_figures(local.recording(), local.recording())).c_str());
    for (const auto& profile : profiles)
      for (const auto& disturbance : kDisturbances) {
        const bool is_wanted =
            disturbances.empty() ||
            std::count(disturbances.begin(), disturbances.end(), disturbance.name) > 0;
        if (!is_wanted) continue;
        // With multicast blocked, programs with the profile that needs it wait for half a minute,
        // a recorder for a minute. The tests check their messages.
        const bool flies = disturbance.name != "no multicast" || profile != "lan";
        std::printf(
            "| `%s` | %s | %s\n", profile.c_str(), disturbance.name.c_str(),
            flies ? fly(file, profile, disturbance, local).c_str() : "says so and ends | | | | |");
        std::fflush(stdout);
      }
  } catch (const std::exception& error) {
    std::fprintf(stderr, "network_table: error: %s\n", error.what());
    return 1;
  }
  return 0;
}
