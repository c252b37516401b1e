// The measurements of `./sls bench` that are neither programs of their own nor benchmarks of one
// function. Each prints one line of JSON on stdout (stamps: CSV). README.md.
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "bench/feeder.hpp"
#include "bench/ping_pong.hpp"
#include "bench/recording_speed.hpp"
#include "bench/stamps.hpp"
#include "bench/timer_jitter.hpp"
#include "closed_loop/flight.hpp"
#include "common/app/run_main.hpp"
#include "common/bus/qos_file.hpp"
#include "common/config/scenario.hpp"

namespace {

using namespace sls;

void print(const nlohmann::json& json) { std::puts(json.dump().c_str()); }

/// The other process of the ping-pong, which ends with this one.
class AnsweringProcess {
 public:
  explicit AnsweringProcess(const bench::PingPongOptions& options) {
    std::vector<std::string> words = {"sls_bench_probe", "pong",
                                      "--qos",           options.qos_file.string(),
                                      "--domain",        std::to_string(options.domain),
                                      "--vehicles",      std::to_string(options.vehicles)};
    if (options.uses_bus) words.push_back("--bus");
    std::vector<char*> command;
    for (std::string& word : words) command.push_back(word.data());
    command.push_back(nullptr);
    id_ = fork();
    if (id_ < 0) throw app::RunError("ping: cannot start another process");
    if (id_ > 0) return;
    prctl(PR_SET_PDEATHSIG, SIGTERM);
    execv("/proc/self/exe", command.data());
    _exit(127);
  }
  ~AnsweringProcess() {
    kill(id_, SIGTERM);
    waitpid(id_, nullptr, 0);
  }
  AnsweringProcess(const AnsweringProcess&) = delete;
  AnsweringProcess& operator=(const AnsweringProcess&) = delete;

 private:
  pid_t id_ = -1;
};

nlohmann::json time_flight(const config::Scenario& scenario) {
  closed_loop::Flight flight(scenario);
  std::uint64_t steps = 0;
  const auto began = std::chrono::steady_clock::now();
  while (flight.fly_step()) ++steps;
  const std::chrono::duration<double, std::micro> elapsed =
      std::chrono::steady_clock::now() - began;
  return {{"steps", steps}, {"mean_us", elapsed.count() / static_cast<double>(steps)}};
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App cli("Measures what ./sls bench compares: see bench/README.md.");
  cli.require_subcommand(1);
  app::CommonOptions options;
  options.qos_file = bus::default_qos_file();
  options.log_level = "warning";
  bench::PingPongOptions ping_pong;
  bench::StampsOptions stamps;
  bench::FeederOptions feeder;
  std::filesystem::path scenario_file, folder;
  std::optional<double> period_s;
  std::uint32_t vehicles = 1;
  std::size_t steps = 1000;
  double seconds = 5.0;

  const auto add = [&](const char* name, const char* description) {
    CLI::App* command = cli.add_subcommand(name, description);
    app::add_common_options(*command, options);
    return command;
  };
  const auto add_scenario = [&](CLI::App* command) {
    command->add_option("--scenario", scenario_file, "scenario (YAML)")->required();
    command->add_option("--period-s", period_s, "control period in force");
  };
  const auto add_vehicles = [&](CLI::App* command) {
    command->add_option("--vehicles", vehicles, "vehicles in the run")->check(CLI::Range(1, 256));
  };
  const auto add_steps = [&](CLI::App* command) {
    command->add_option("--steps", steps, "steps of the run")->check(CLI::Range(2, 10'000'000));
  };

  CLI::App* ping = add("ping", "round trips of the loop's samples with a process that answers");
  CLI::App* pong = add("pong", "that process");
  for (CLI::App* command : {ping, pong}) {
    add_vehicles(command);
    command->add_flag("--bus", ping_pong.uses_bus, "through common/bus, not on bare Fast DDS");
  }
  ping->add_option("--round-trips", ping_pong.round_trips, "measured")
      ->check(CLI::Range(1, 100'000'000));
  CLI::App* fly = add("fly", "plant and control law of a flight, without anything else");
  add_scenario(fly);
  CLI::App* timer = add("timer", "how late this machine wakes a thread that sleeps until a time");
  timer->add_option("--period-s", period_s, "between two times")->required();
  timer->add_option("--seconds", seconds, "how long");
  CLI::App* stamp = add("stamps", "when the states of a run were written");
  stamp->add_flag("--live", stamps.is_live, "from now on, instead of what the writer has kept");
  CLI::App* record = add("record", "Recording, fed in this process");
  add_scenario(record);
  add_vehicles(record);
  add_steps(record);
  record->add_option("--folder", folder, "for the files, which are removed again")->required();
  CLI::App* feed = add("feed", "sends a recorder a whole flight as fast as it takes it");
  add_scenario(feed);
  add_vehicles(feed);
  add_steps(feed);

  return app::run_main(argc, argv, cli, options, "sls_bench", [&] {
    ping_pong.qos_file = stamps.qos_file = feeder.qos_file = options.qos_file;
    ping_pong.domain = stamps.domain = feeder.domain = options.domain;
    ping_pong.vehicles = feeder.vehicles = vehicles;
    feeder.steps = steps;
    const auto load = [&] {
      config::Scenario scenario = config::load_scenario(scenario_file);
      if (period_s) config::override_period(scenario, *period_s);
      return scenario;
    };
    if (*ping) {
      const AnsweringProcess answering(ping_pong);
      print(bench::ping(ping_pong));
    } else if (*pong) {
      bench::answer(ping_pong);
    } else if (*fly) {
      print(time_flight(load()));
    } else if (*timer) {
      print(bench::measure_timer(*period_s, seconds));
    } else if (*stamp) {
      bench::print_stamps(stamps);
    } else if (*record) {
      print(bench::measure_recording(load(), vehicles, steps, folder));
    } else {
      print(bench::feed_recorder(load(), feeder));
    }
  });
}
