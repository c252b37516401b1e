// The measurements of `./sls bench` for which there is no other program: sls_microbench has those
// of single functions. Each prints one line of JSON on stdout (stamps: CSV). README.md.
#include <sched.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <cstdio>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "bench/feeder.hpp"
#include "bench/hand_over.hpp"
#include "bench/ping_pong.hpp"
#include "bench/recording_speed.hpp"
#include "bench/stamps.hpp"
#include "bench/timer_jitter.hpp"
#include "closed_loop/flight.hpp"
#include "closed_loop/flight_recorder.hpp"
#include "common/app/run_main.hpp"
#include "common/bus/convert.hpp"
#include "common/bus/qos_file.hpp"
#include "common/bus/spinning.hpp"
#include "common/config/scenario.hpp"

namespace {

using namespace sls;

void print(const nlohmann::json& json) { std::puts(json.dump().c_str()); }

/// The other process of the ping-pong. It ends with this process.
class AnsweringProcess {
 public:
  explicit AnsweringProcess(const bench::PingPongOptions& options) {
    std::vector<std::string> words = {"sls_bench_probe", "pong",
                                      "--qos",           options.qos_file.string(),
                                      "--domain",        std::to_string(options.domain),
                                      "--vehicles",      std::to_string(options.vehicles)};
    if (options.may_spin) words.push_back("--spin");
    std::vector<char*> command;
    for (std::string& word : words) command.push_back(word.data());
    command.push_back(nullptr);
    // Under valgrind the link itself names valgrind.
    const std::string program = std::filesystem::read_symlink("/proc/self/exe");
    id_ = fork();
    if (id_ < 0) throw app::RunError("ping: cannot start another process");
    if (id_ > 0) return;
    prctl(PR_SET_PDEATHSIG, SIGTERM);
    execv(program.c_str(), command.data());
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

/// The processors of this process and of the other one; empty: no choice.
using Processors = std::vector<int>;

/// Sets the processor of this thread and of all that it starts later.
void stay_on(const Processors& processors, std::size_t process) {
  if (processors.empty()) return;
  cpu_set_t set;
  CPU_ZERO(&set);
  CPU_SET(processors[process], &set);
  if (sched_setaffinity(0, sizeof set, &set) != 0)
    throw app::RunError("processor " + std::to_string(processors[process]) + ": cannot run there");
}

/// Times a flight in one process: the parts of a step and, if `folder` is not empty, a whole step
/// with recorded files.
nlohmann::json time_flight(const config::Scenario& scenario, const std::filesystem::path& folder) {
  using Clock = std::chrono::steady_clock;
  using Microseconds = std::chrono::duration<double, std::micro>;
  closed_loop::FlightOptions options;
  options.measures_compute_time = true;
  closed_loop::Flight flight(scenario, {0}, options);
  double steps = 0.0;
  Microseconds law{0}, entries{0};
  RecordEntry entry;
  auto began = Clock::now();
  while (const model::StepRecord* flown = flight.fly_step()) {
    const auto answered = Clock::now();
    bus::fill(entry, *flown);
    entries += Clock::now() - answered;
    law += flown->answer.compute_time;
    ++steps;
  }
  const Microseconds whole = Clock::now() - began;
  nlohmann::json json = {{"plant_us", (whole - law - entries).count() / steps},
                         {"law_us", law.count() / steps},
                         {"entries_us", entries.count() / steps}};
  if (folder.empty()) return json;
  began = Clock::now();
  const auto end = closed_loop::fly_recorded(scenario, options, folder, false);
  json["recorded_us"] = Microseconds(Clock::now() - began).count() / steps;
  if (!end.is_complete) throw app::RunError("fly: the recording is not complete");
  return json;
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
  bench::HandOverOptions hand_over;
  Processors processors;
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
    command->add_flag("--spin", ping_pong.may_spin,
                      "as server and client do in lockstep; of sls_bench_spinning_probe");
  }
  CLI::App* turns = add("hand-over", "turns of two processes by futex, with work in one of them");
  turns->add_option("--rounds", hand_over.rounds, "measured")->check(CLI::Range(1, 100'000'000));
  turns->add_option("--work-us", hand_over.work_us, "work in each round")
      ->check(CLI::Range(0.0, 1e6));
  turns->add_flag("--spin", hand_over.may_spin, "look for up to 50 µs before a wait blocks");
  for (CLI::App* command : {ping, turns})
    command->add_option("--processors", processors, "of this process and of the other one")
        ->expected(2);
  ping->add_option("--round-trips", ping_pong.round_trips, "measured")
      ->check(CLI::Range(1, 100'000'000));
  CLI::App* fly = add("fly", "the parts of a flight in one process");
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
  fly->add_option("--folder", folder, "for a recording, new");
  CLI::App* feed = add("feed", "sends a recorder a whole flight as fast as it takes it");
  add_scenario(feed);
  add_vehicles(feed);
  add_steps(feed);

  return app::run_main(argc, argv, cli, options, "sls_bench", [&] {
    ping_pong.qos_file = stamps.qos_file = feeder.qos_file = options.qos_file;
    ping_pong.domain = stamps.domain = feeder.domain = options.domain;
    ping_pong.vehicles = feeder.vehicles = vehicles;
    feeder.steps = steps;
    bus::is_spinning = ping_pong.may_spin;
    const auto load = [&] {
      config::Scenario scenario = config::load_scenario(scenario_file);
      if (period_s) config::override_period(scenario, *period_s);
      return scenario;
    };
    if (*ping) {
      stay_on(processors, 1);
      const AnsweringProcess answering(ping_pong);
      stay_on(processors, 0);
      print(bench::ping(ping_pong));
    } else if (*pong) {
      bench::answer(ping_pong);
    } else if (*turns) {
      stay_on(processors, 1);
      bench::HandOver two(hand_over);
      stay_on(processors, 0);
      print(two.measure());
    } else if (*fly) {
      print(time_flight(load(), folder));
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
