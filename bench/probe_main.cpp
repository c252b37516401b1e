// The measurements of `./sls bench` for which there is no other program: sls_microbench has those
// of single functions. Prints one line of JSON on stdout; timer and stamps print CSV. README.md.
#include <sched.h>

#include <CLI/CLI.hpp>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <mutex>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "bench/hand_over.hpp"
#include "closed_loop/flight.hpp"
#include "closed_loop/flight_recorder.hpp"
#include "common/app/run_error.hpp"
#include "common/app/run_main.hpp"
#include "common/app/stop_signal.hpp"
#include "common/app/wait.hpp"
#include "common/bus/convert.hpp"
#include "common/bus/node.hpp"
#include "common/bus/qos_file.hpp"
#include "common/config/scenario.hpp"

namespace {

using namespace sls;
using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

constexpr double kFirstSampleLimit_s = 20.0;
constexpr auto kSilenceOfRun = 2s;

void print(const nlohmann::json& json) { std::puts(json.dump().c_str()); }

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

/// A line of CSV for each step: its number and a time, ns.
struct Stamp {
  std::uint64_t step;
  std::chrono::nanoseconds at;
};

void print(const std::vector<Stamp>& stamps) {
  for (const auto& [step, at] : stamps)
    std::printf("%llu,%lld\n", static_cast<unsigned long long>(step),
                static_cast<long long>(at.count()));
  if (std::fflush(stdout) != 0) throw app::RunError("stdout cannot be written");
}

/// When a thread woke up that slept until each multiple of `period_s`: the bound of every real-time
/// loop.
std::vector<Stamp> measure_timer(double period_s, double seconds) {
  const std::chrono::duration<double> period(period_s);
  const auto count = static_cast<std::uint64_t>(seconds / period_s);
  const auto began = Clock::now();
  std::vector<Stamp> stamps;
  for (std::uint64_t k = 1; k <= count && app::stop_signal() == 0; ++k) {
    std::this_thread::sleep_until(
        began + std::chrono::duration_cast<Clock::duration>(period * static_cast<double>(k)));
    stamps.push_back({k, Clock::now() - began});
  }
  return stamps;
}

/// When the server wrote each sample of sls/state, by the server's clock, until no more come.
/// @throws app::RunError if no sample comes.
std::vector<Stamp> listen_to_states(const app::CommonOptions& options) {
  bus::Node node(options.qos_file, options.domain, "bench", "recorder");
  std::mutex mutex;  // guards stamps and last
  std::vector<Stamp> stamps;
  Clock::time_point last;
  {
    bus::Reader<States> states(
        node, bus::kLoopReaderProfile, [&](const States& sample, const bus::PeerId&) {
          const std::lock_guard lock(mutex);
          stamps.push_back({sample.step(), states.written().time_since_epoch()});
          last = Clock::now();
        });
    const app::Wait wait(kFirstSampleLimit_s);
    for (bool is_over = false; !is_over && app::stop_signal() == 0;) {
      std::this_thread::sleep_for(10ms);
      const std::lock_guard lock(mutex);
      if (stamps.empty() && wait.is_over()) throw app::RunError("stamps: no samples");
      is_over = !stamps.empty() && Clock::now() - last > kSilenceOfRun;
    }
  }
  return stamps;
}

}  // namespace

int main(int argc, char** argv) {
  app::CommandLine cli("Measures what ./sls bench compares: see bench/README.md.");
  cli.app().require_subcommand(1);
  app::CommonOptions options;
  options.qos_file = bus::default_qos_file();
  options.log_level = "warning";
  bench::HandOverOptions hand_over;
  Processors processors;
  std::filesystem::path scenario_file, folder;
  std::optional<double> period_s;
  double seconds = 5.0;

  const auto add = [&](const char* name, const char* description) {
    CLI::App* command = cli.app().add_subcommand(name, description);
    app::add_common_options(*command, options);
    return command;
  };
  CLI::App* turns = add("hand-over", "turns of two processes by futex, with work in one of them");
  turns->add_option("--rounds", hand_over.rounds, "measured")->check(CLI::Range(1, 100'000'000));
  turns->add_option("--work-us", hand_over.work_us, "work in each round")
      ->check(CLI::Range(0.0, 1e6));
  turns->add_flag("--spin", hand_over.may_spin, "look for up to 50 µs before a wait blocks");
  turns->add_option("--processors", processors, "of this process and of the other one")
      ->expected(2);
  CLI::App* fly = add("fly", "the parts of a flight in one process");
  fly->add_option("--scenario", scenario_file, "scenario (YAML)")->required();
  fly->add_option("--period-s", period_s, "control period in force");
  fly->add_option("--folder", folder, "for a recording, new");
  CLI::App* timer = add("timer", "when this machine wakes a thread that sleeps until a time");
  timer->add_option("--period-s", period_s, "between two times")->required();
  timer->add_option("--seconds", seconds, "how long");
  add("stamps", "when the states of a run are written, from now on");

  return app::run_main(argc, argv, cli, options, "sls_bench", [&] {
    if (*turns) {
      stay_on(processors, 1);
      bench::HandOver two(hand_over);
      stay_on(processors, 0);
      print(two.measure());
    } else if (*fly) {
      config::Scenario scenario = config::load_scenario(scenario_file);
      if (period_s) config::override_period(scenario, *period_s);
      print(time_flight(scenario, folder));
    } else if (*timer) {
      print(measure_timer(*period_s, seconds));
    } else {
      print(listen_to_states(options));
    }
  });
}
