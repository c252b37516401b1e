#include <cstdio>
#include <optional>

#include "closed_loop/delay_margin.hpp"
#include "common/app/run_error.hpp"
#include "common/app/run_main.hpp"
#include "common/app/stop_signal.hpp"
#include "common/config/scenario.hpp"

int main(int argc, char** argv) {
  using namespace sls;
  app::CommandLine cli("Finds the command delay at which a scenario's controllers lose the load.");
  const app::CommonOptions options;  // no network here; only errors are logged
  std::filesystem::path scenario_file;
  std::optional<double> period_s;
  std::optional<std::uint32_t> vehicle;
  cli.add_option("--scenario", scenario_file, "scenario (YAML)").type_name("FILE").required();
  cli.add_option("--period-s", period_s, "control period (default: the scenario's)").type_name("X");
  cli.add_option("--vehicle", vehicle, "delay the commands of vehicle N alone (default: of all)")
      .type_name("N");

  return app::run_main(argc, argv, cli, options, "delay_margin", [&] {
    config::Scenario scenario = config::load_scenario(scenario_file);
    if (period_s) config::override_period(scenario, *period_s);
    const closed_loop::DelayMargin margin =
        closed_loop::find_delay_margin(scenario, vehicle, [](const closed_loop::DelayedFlight&) {
          if (app::stop_signal() != 0) throw app::RunError("interrupted");
        });
    std::fputs(closed_loop::to_text(margin).c_str(), stdout);
    if (std::fflush(stdout) != 0) throw app::RunError("the table could not be written to stdout");
  });
}
