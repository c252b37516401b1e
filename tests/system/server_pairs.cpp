/// Pairs of servers for one vehicle that start together on one domain, with a client and a
/// recorder: one of each pair must fly, and the other must end and name it. The pairs follow each
/// other on the same domain. A seed repeats the moments of the starts, but not the timing of the
/// machine.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <random>
#include <string>
#include <thread>

#include "tests/system/flight.hpp"

namespace sls::test {
namespace {

using namespace std::chrono_literals;

constexpr int kLongestOffset_ms = 100;  // between the starts of the two servers; half have none

/// Empty, or what went wrong.
std::string fly_pair(int domain, std::chrono::milliseconds offset) {
  TemporaryFolder folder;
  // 100 steps in 2 s: a flight in lockstep could be over before a busy machine starts the other
  // server.
  const auto server =
      make_command("sim_server", domain,
                   {"--scenario", scenario("short"), "--period-s", "0.02", "--mode", "realtime"});
  Process recorder(make_command("recorder", domain, {"--out", folder / "recording"}));
  Process client(make_command("control_client", domain, {"--scenario", scenario("short")}));
  Process one(server);
  std::this_thread::sleep_for(offset);
  Process two(server);
  std::string outputs;
  bool have_ended = true;
  for (Process* process : {&one, &two, &client, &recorder}) {
    have_ended = process->wait(60s).has_value() && have_ended;
    outputs += process->output();
  }
  if (!have_ended) return "not ended within 60 s\n" + outputs;
  const auto is_refused = [](Process& process) {
    return process.wait() == 1 &&
           process.output().find("vehicle 0: expected no other server") != std::string::npos;
  };
  const bool does_one_fly =
      (one.wait() == 0 && is_refused(two)) || (two.wait() == 0 && is_refused(one));
  if (!does_one_fly) return "expected one server to fly and the other to be refused\n" + outputs;
  if (client.wait() != 0 || recorder.wait() != 0)
    return "expected client and recorder to take part in the flight\n" + outputs;
  return "";
}

int fly_pairs(int pairs, std::uint64_t seed) {
  const OwnDomain domain;
  std::mt19937_64 random(seed);
  int failed = 0;
  for (int i = 1; i <= pairs; ++i) {
    const bool is_together = random() % 2 == 0;
    const std::chrono::milliseconds offset(is_together ? 0 : random() % kLongestOffset_ms);
    const std::string failure = fly_pair(domain.number(), offset);
    if (failure.empty()) continue;
    ++failed;
    std::printf("pair %d, starts %d ms apart: %s", i, static_cast<int>(offset.count()),
                failure.c_str());
    std::fflush(stdout);
  }
  std::printf("%d pairs of servers with seed %llu: one of each pair flew, except %d\n", pairs,
              static_cast<unsigned long long>(seed), failed);
  return failed == 0 ? 0 : 1;
}

}  // namespace
}  // namespace sls::test

int main(int argc, char** argv) {
  CLI::App cli(
      "Starts pairs of servers for one vehicle together and checks that one of each flies.");
  int pairs = 10;
  std::uint64_t seed = 1;
  cli.option_defaults()->always_capture_default();
  cli.add_option("--pairs", pairs, "number of pairs")->type_name("N")->check(CLI::Range(1, 100000));
  cli.add_option("--seed", seed, "seed of the moments of the starts")->type_name("S");
  CLI11_PARSE(cli, argc, argv);
  return sls::test::fly_pairs(pairs, seed);
}
