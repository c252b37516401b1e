#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <thread>

#include "common/app/log.hpp"
#include "common/app/run_main.hpp"
#include "common/bus/end_process.hpp"
#include "common/bus/node.hpp"
#include "common/bus/participants.hpp"
#include "common/bus/qos_file.hpp"
#include "common/bus/security_files.hpp"
#include "common/config/scenario.hpp"
#include "common/config/vehicle_ids.hpp"
#include "common/plugin/shared_library.hpp"
#include "sim_server/server.hpp"

namespace {

constexpr const char* kIdentity = "server";  // name of its keys on a secured domain

}  // namespace

int main(int argc, char** argv) {
  using namespace sls;
  app::CommandLine cli(
      "Simulates the vehicles of a scenario and publishes their states on DDS topics.");
  app::CommonOptions options;
  options.qos_file = bus::default_qos_file();
  std::filesystem::path scenario_file;
  std::optional<double> period_s;
  std::string mode;
  std::optional<double> real_time_factor;
  std::string vehicles = "all";
  std::size_t threads = std::max(1u, std::thread::hardware_concurrency());
  bool check = false;
  cli.add_common_options(options);
  cli.add_option("--scenario", scenario_file, "scenario (YAML)").type_name("FILE").required();
  cli.add_option("--period-s", period_s, "control period (default: the scenario's)").type_name("X");
  cli.add_option("--mode", mode, "lockstep or realtime (default: the scenario's)")
      .type_name("MODE")
      .one_of({"lockstep", "realtime"});
  cli.add_option("--rtf", real_time_factor,
                 "real-time factor, realtime mode only (default: the scenario's)")
      .type_name("X");
  cli.add_option("--vehicles", vehicles, "vehicles of the fleet to simulate, such as 0-9,20")
      .type_name("IDS");
  cli.add_option("--threads", threads,
                 "threads that integrate vehicles (default: one per processor)")
      .type_name("N")
      .range(1, 256);
  cli.add_flag("--check", check, "check scenario and QoS file, print a summary and exit");

  const int code = app::run_main(argc, argv, cli, options, "sim_server", [&] {
    config::Scenario scenario = config::load_scenario(scenario_file);
    for (const std::string& warning : scenario.warnings) app::log({true, warning});
    if (period_s) config::override_period(scenario, *period_s);
    if (!mode.empty())
      scenario.sync.mode =
          mode == "lockstep" ? config::SyncMode::kLockstep : config::SyncMode::kRealtime;
    if (real_time_factor) config::override_real_time_factor(scenario, *real_time_factor);
    const sim::Assignment assignment = {
        scenario, config::parse_vehicle_ids(vehicles, scenario.vehicles.size())};
    // A plant that cannot be made is refused before other programs wait for this server.
    sim::make_plants(sim::find_plant_type(scenario.plant.model), scenario, assignment.vehicle_ids);
    if (check) {
      bus::check_security_files(bus::read_qos_file(options.qos_file, kIdentity));
      const bool is_lockstep = scenario.sync.mode == config::SyncMode::kLockstep;
      const std::size_t count = assignment.vehicle_ids.size();
      app::print(fmt::format("{}: {}, {} vehicle{}, period {} s", scenario.name,
                             is_lockstep ? "lockstep" : "real time", count, count > 1 ? "s" : "",
                             scenario.sync.period_ns * 1e-9));
      return;
    }
    bus::Node node(options.qos_file, options.domain, bus::kServerNode, kIdentity);
    sim::Server(node, assignment, threads).run();
  });
  if (!plugin::is_any_loaded()) bus::end_process(code);
  return code;
}
