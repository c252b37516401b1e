#include <spdlog/spdlog.h>

#include <chrono>
#include <optional>

#include "closed_loop/flight_recorder.hpp"
#include "common/app/log.hpp"
#include "common/app/run_error.hpp"
#include "common/app/run_main.hpp"
#include "common/app/stop_signal.hpp"

int main(int argc, char** argv) {
  using namespace sls;
  app::CommandLine cli("Flies a scenario in one process without DDS, as fast as possible.");
  const app::CommonOptions options;  // no network here
  std::filesystem::path scenario_file, folder;
  std::optional<double> period_s;
  bool force = false;
  closed_loop::FlightOptions flight;
  cli.add_option("--scenario", scenario_file, "scenario (YAML)").type_name("FILE").required();
  cli.add_option("--out", folder, "folder of the recording, new or empty (default: no recording)")
      .type_name("DIR")
      .check([](const std::string& given) {
        return given.empty() ? "expected a folder, got ''" : "";
      });
  cli.add_flag("--force", force, "replace an existing recording");
  cli.add_option("--period-s", period_s, "control period (default: the scenario's)").type_name("X");
  cli.add_flag(
      "--check-purity", flight.checks_purity,
      "compute every answer twice and refuse a law whose answers differ (default: only in the "
      "first 100 steps)");

  return app::run_main(argc, argv, cli, options, "closed_loop", [&] {
    config::Scenario scenario = config::load_scenario(scenario_file);
    for (const std::string& warning : scenario.warnings) app::log({true, warning});
    if (period_s) config::override_period(scenario, *period_s);
    scenario.sync.mode = config::SyncMode::kLockstep;  // no answer can be late here
    const auto began = std::chrono::steady_clock::now();
    closed_loop::FlightEnd end;
    if (folder.empty()) {
      closed_loop::Flight flown(scenario, closed_loop::list_vehicles(scenario), flight);
      while (app::stop_signal() == 0 && flown.fly_step()) end.last_step = flown.steps()[0].step;
      for (const std::string& remark : flown.take_remarks()) app::log({true, remark});
      end.failure = app::stop_signal() != 0 ? "interrupted" : flown.failure();
    } else {
      flight.measures_compute_time = true;
      end = closed_loop::fly_recorded(scenario, flight, folder, force);
    }
    const double wall_s =
        std::chrono::duration<double>(std::chrono::steady_clock::now() - began).count();
    if (!end.failure.empty())
      throw app::RunError(fmt::format("step {}: {}", end.last_step, end.failure));
    if (!folder.empty() && !end.is_complete)
      throw app::RunError(fmt::format("{}: the recording is not complete", folder.string()));
    const auto steps = static_cast<double>(end.last_step);
    spdlog::info("finished: {} steps, {} s simulated in {:.2f} s, {:.0f} steps/s", end.last_step,
                 steps * static_cast<double>(scenario.sync.period_ns) / 1e9, wall_s,
                 steps / wall_s);
  });
}
