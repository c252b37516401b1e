#include "common/app/run_main.hpp"
#include "common/bus/end_process.hpp"
#include "common/bus/node.hpp"
#include "common/bus/qos_file.hpp"
#include "common/config/scenario.hpp"
#include "common/config/vehicle_ids.hpp"
#include "common/plugin/shared_library.hpp"
#include "control_client/client.hpp"

namespace {

constexpr const char* kIdentity = "controller";  // name of its keys on a secured domain

}  // namespace

int main(int argc, char** argv) {
  using namespace sls;
  app::CommandLine cli("Flies a scenario's mission: answers every state with a control force.");
  app::CommonOptions options;
  options.qos_file = bus::default_qos_file();
  std::filesystem::path scenario_file;
  std::string vehicles = "all";
  control::ClientOptions client;
  cli.add_common_options(options);
  cli.add_option("--scenario", scenario_file, "scenario (YAML); must be the server's")
      .type_name("FILE")
      .required();
  cli.add_option("--strength", client.strength,
                 "of several clients for a vehicle, the one with the highest strength flies")
      .type_name("N");
  cli.add_option("--vehicles", vehicles,
                 "vehicles of the fleet to control, such as 0-9,20; all: the server's")
      .type_name("IDS");
  cli.add_flag("--follow", client.follows_servers,
               "continue with a server that replaces the first (default: exit with code 1)");
  cli.add_flag(
      "--check-purity", client.checks_purity,
      "compute every answer twice and refuse a law whose answers differ (default: only in the "
      "first 100 steps)");
  cli.add_option("--name", client.name, "name of this client in recordings and messages")
      .check(&control::describe_name_defect)
      .type_name("NAME");

  const int code = app::run_main(argc, argv, cli, options, "control_client", [&] {
    const config::Scenario scenario = config::load_scenario(scenario_file);
    const auto vehicle_ids = config::parse_vehicle_ids(vehicles, scenario.vehicles.size());
    // Refuses a law that cannot be made before other programs wait for this client.
    control::FlightController(config::make_vehicle_scenario(scenario, vehicle_ids.front()),
                              vehicle_ids.front());
    bus::Node node(options.qos_file, options.domain, bus::kClientNode, kIdentity);
    control::Client(node, scenario, vehicle_ids, client).run();
  });
  if (!plugin::is_any_loaded()) bus::end_process(code);
  return code;
}
