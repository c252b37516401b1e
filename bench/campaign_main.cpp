// Flies the runs of a campaign in one C++ process, for comparison with `./sls campaign`, or
// measures the parts of a run. Prints one line of JSON on stdout. README.md.
#include <chrono>
#include <cstdio>
#include <ctime>
#include <fstream>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "closed_loop/campaign_runs.hpp"
#include "common/app/run_main.hpp"
#include "common/app/stop_signal.hpp"

namespace {

using namespace sls;
using Clock = std::chrono::steady_clock;

const std::vector<std::string> kMeasures = {"load_error_rms", "load_error_max", "settling",
                                            "overshoot",      "tilt_max",       "force_max",
                                            "time_of_loss"};

double calc_seconds(Clock::time_point began) {
  return std::chrono::duration<double>(Clock::now() - began).count();
}

std::vector<std::string> read_lines(const std::filesystem::path& file) {
  std::ifstream stream(file);
  std::vector<std::string> lines;
  for (std::string line; std::getline(stream, line);) lines.push_back(line);
  if (lines.empty()) throw config::ConfigError(file.string() + ": expected a value in each line");
  return lines;
}

struct Options {
  std::filesystem::path scenario, values;
  std::string path;
  bool certify = false;
};

/// Flies all runs as a worker of a campaign does.
nlohmann::json fly(const Options& options) {
  auto began = Clock::now();
  const closed_loop::CampaignRuns runs(options.scenario, {options.path}, kMeasures);
  nlohmann::json json;
  json["base_s"] = calc_seconds(began);
  const std::vector<std::string> values = read_lines(options.values);
  std::uint64_t steps = 0, finished = 0;
  began = Clock::now();
  for (const std::string& value : values) {
    const closed_loop::MeasuredFlight flown = runs.fly({value}, options.certify);
    steps += flown.steps;
    finished += flown.outcome == closed_loop::Outcome::kFinished ? 1 : 0;
    if (app::stop_signal() != 0) break;
  }
  json["seconds"] = calc_seconds(began);
  json["runs"] = values.size();
  json["steps"] = steps;
  json["finished"] = finished;
  return json;
}

/// CPU time of this process, s. It does not include other work on the machine.
double take_cpu_seconds() {
  return static_cast<double>(std::clock()) / static_cast<double>(CLOCKS_PER_SEC);
}

/// CPU seconds of each part, summed over the runs. Each run is timed part after part.
nlohmann::json time_parts(const Options& options) {
  const closed_loop::CampaignRuns runs(options.scenario, {options.path}, kMeasures);
  const std::vector<std::string> values = read_lines(options.values);
  const config::Scenario base = config::load_scenario(options.scenario);
  const closed_loop::MeasureList all(base, kMeasures);
  const closed_loop::FlightErrors errors = closed_loop::fly_base(base);
  double scenario = 0.0, flight = 0.0, steps = 0.0, measured = 0.0, certified = 0.0;
  std::uint64_t count = 0;
  for (const std::string& value : values) {
    double began = take_cpu_seconds();
    const config::Scenario run = runs.make_scenario({value});
    scenario += take_cpu_seconds() - began;
    began = take_cpu_seconds();
    closed_loop::Flight alone(run);
    flight += take_cpu_seconds() - began;
    began = take_cpu_seconds();
    while (alone.fly_step()) ++count;
    steps += take_cpu_seconds() - began;
    began = take_cpu_seconds();
    closed_loop::fly_measured(run, all, errors, false);
    measured += take_cpu_seconds() - began;
    began = take_cpu_seconds();
    closed_loop::fly_measured(run, all, errors, true);
    certified += take_cpu_seconds() - began;
    if (app::stop_signal() != 0) break;
  }
  return {{"runs", values.size()},
          {"steps", count},
          {"scenario_s", scenario},
          {"flight_s", flight},
          {"steps_s", steps},
          {"measures_s", measured - flight - steps},
          {"certificate_s", certified - measured}};
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App cli("Flies the runs of a campaign in one process: see bench/README.md.");
  cli.require_subcommand(1);
  app::CommonOptions common;  // no network here
  common.log_level = "warning";
  Options options;
  cli.set_version_flag("--version", app::version());
  const auto add = [&](const char* name, const char* meaning) {
    CLI::App* command = cli.add_subcommand(name, meaning);
    command->add_option("--scenario", options.scenario, "base scenario")->required();
    command->add_option("--path", options.path, "the key that varies")->required();
    command->add_option("--values", options.values, "its values, one a line")->required();
    return command;
  };
  CLI::App* flown = add("fly", "flies them all; with all measures");
  flown->add_flag("--certify", options.certify, "with certificates");
  add("parts", "what a run is made of");
  return app::run_main(argc, argv, cli, common, "sls_bench_campaign", [&] {
    const nlohmann::json json = flown->parsed() ? fly(options) : time_parts(options);
    std::puts(json.dump().c_str());
  });
}
