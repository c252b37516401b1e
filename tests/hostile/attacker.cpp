/// One attack, until SIGTERM.
#include <sys/resource.h>

#include <CLI/CLI.hpp>

#include <chrono>
#include <functional>
#include <iostream>
#include <map>

#include "common/app/stop_signal.hpp"
#include "tests/hostile/attack.hpp"

namespace sls::hostile {

bool goes_on(const Target& target) {
  using Clock = std::chrono::steady_clock;
  static const auto end = Clock::now() + std::chrono::duration_cast<Clock::duration>(
                                             std::chrono::duration<double>(target.seconds));
  return app::stop_signal() == 0 && Clock::now() < end;
}

void say_that_it_fires() {
  static const bool is_said = static_cast<bool>(std::cout << "fires" << std::endl);
  static_cast<void>(is_said);
}

}  // namespace sls::hostile

int main(int argc, char** argv) {
  using namespace sls::hostile;
  CLI::App cli("Attacks a flight, for tests.");
  Target target;
  std::string attack, file;
  std::uint64_t most = 3000;
  cli.add_option("ATTACK", attack)->required();
  cli.add_option("--to", target.addresses, "a host of the flight");
  cli.add_option("--domain", target.domain);
  cli.add_option("--seed", target.seed);
  cli.add_option("--seconds", target.seconds, "at most");
  cli.add_option("--file", file, "captured packets");
  cli.add_option("--most", most, "forged participants, changed packets");
  CLI11_PARSE(cli, argc, argv);

  const std::map<std::string, std::function<std::uint64_t()>> attacks = {
      {"capture", [&] { return capture(target, file); }},
      {"packets", [&] { return fire_packets(target, file); }},
      {"announcements", [&] { return announce_forgeries(target, file, most); }},
      {"mutations", [&] { return fire_mutations(target, file, most); }},
      {"spoof", [&] { return spoof(target); }},
      {"come-and-go", [&] { return come_and_go(target); }},
      {"commands", [&] { return flood_commands(target); }},
      {"statements", [&] { return forge_statements(target); }},
      {"control", [&] { return flood_control(target); }},
      {"silent-controller", [&] { return pose_as_controller(target, false); }},
      {"mad-controller", [&] { return pose_as_controller(target, true); }},
      {"readers", [&] { return read_all(target); }},
      {"malformed", [&] { return write_malformed(target); }}};
  sls::app::install_stop_signals();
  // A real attacker has its own processors. Here it must not slow the flight down.
  setpriority(PRIO_PROCESS, 0, 10);
  try {
    const std::uint64_t count = attacks.at(attack)();
    std::cout << attack << ": " << count << std::endl;
  } catch (const std::exception& error) {
    std::cout << attack << ": error: " << error.what() << std::endl;
    return 1;
  }
}
