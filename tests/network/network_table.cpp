/// ./sls network-table: flies every QoS profile through every disturbance of tests/network/ and
/// prints the effect of each as a Markdown table.
#include <gtest/gtest.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <random>
#include <stdexcept>
#include <thread>

#include "common/config/faults.hpp"
#include "tests/network/hosts_flight.hpp"

namespace {

using namespace sls::test;
using namespace std::chrono_literals;

namespace faults = sls::config::faults;

const faults::Abilities kAbilities = {
    "network-table",
    {"link.loss", "link.delay_ms", "link.jitter_ms", "link.duplicates", "link.bandwidth_mbit",
     "link.mtu_bytes", "link.multicast", "loss", "partition", "step"},
    {}};

/// Draws from the ranges of a file, the same in every call of the program.
double draw(const std::optional<faults::Span>& span, double otherwise = 0.0) {
  static std::mt19937_64 random(1);
  return span ? std::uniform_real_distribution(span->least, span->most)(random) : otherwise;
}

/// Returns the share of the packets that get lost.
double apply(const faults::Link& link, Network& network) {
  const double loss = draw(link.loss);
  network.lose(loss);
  // On the controller's wire, so both ways to and from the others.
  if (link.delay_ms || link.jitter_ms || link.duplicates)
    network.disturb_wire(
        "controller", {draw(link.delay_ms), draw(link.jitter_ms), 100 * draw(link.duplicates), 1});
  if (link.bandwidth_mbit) network.limit_rate(static_cast<int>(1000 * draw(link.bandwidth_mbit)));
  if (link.mtu_bytes) network.set_mtu(static_cast<int>(draw(link.mtu_bytes)));
  if (!link.has_multicast) network.block_multicast();
  return loss;
}

/// In the order of the file: each begins `at_s` after the one before it, or at its step.
void apply(const std::vector<faults::Fault>& given, Flight& flight, Network& network, double loss) {
  const auto sleep = [](double seconds) {
    std::this_thread::sleep_for(std::chrono::duration<double>(seconds));
  };
  for (const faults::Fault& fault : given) {
    if (fault.is_at_step)
      flight.wait_for_steps(static_cast<std::size_t>(draw(fault.at)));
    else
      sleep(draw(fault.at));
    if (fault.kind == faults::Kind::kPartition)
      network.cut();
    else
      network.lose(draw(fault.value));
    sleep(draw(fault.for_s));
    network.lose(loss);
  }
}

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
std::string fly(const std::string& file, const std::string& profile,
                const faults::Case& disturbance, const Flight& local) {
  Network network(kHosts);
  const double loss = apply(disturbance.link, network);
  const Profile configured(network, profile);
  Flight flight(file, configured.flight_options());
  apply(disturbance.faults, flight, network, loss);
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
  std::string given = SLS_SOURCE_DIR "/config/faults/network_table.yaml";
  int vehicles = 1;
  cli.add_option("--profile", profiles, "fly only these profiles (names in config/qos)");
  cli.add_option("--faults", given, "disturbances (YAML, docs/faults.md)")->type_name("FILE");
  cli.add_option("--disturbance", disturbances,
                 "apply only these disturbances (names in the table)");
  cli.add_option("--vehicles", vehicles, "vehicles in each flight")->check(CLI::Range(1, 256));
  CLI11_PARSE(cli, argc, argv);
  try {
    const std::vector<faults::Case> cases = faults::load(given, kAbilities);
    if (const auto obstacle = Network::find_obstacle()) throw std::runtime_error(*obstacle);
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
      for (const faults::Case& disturbance : cases) {
        const bool is_wanted =
            disturbances.empty() ||
            std::count(disturbances.begin(), disturbances.end(), disturbance.name) > 0;
        if (!is_wanted) continue;
        // With multicast blocked, programs with the profile that needs it wait for half a minute,
        // a recorder for a minute. The tests check their messages.
        const bool flies = disturbance.link.has_multicast || profile != "lan";
        std::printf(
            "| `%s` | %s | %s\n", profile.c_str(), disturbance.name.c_str(),
            flies ? fly(file, profile, disturbance, local).c_str() : "says so and ends | | | | |");
        std::fflush(stdout);
      }
  } catch (const sls::config::ConfigError& error) {
    std::fprintf(stderr, "network_table: error: %s\n", error.what());
    return 2;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "network_table: error: %s\n", error.what());
    return 1;
  }
  return 0;
}
