#include <algorithm>
#include <cctype>

#include "common/app/run_main.hpp"
#include "common/bus/node.hpp"
#include "common/bus/qos_file.hpp"
#include "common/config/scenario.hpp"
#include "common/config/vehicle_ids.hpp"
#include "control_client/client.hpp"

namespace {

constexpr const char* kIdentity = "controller";  // whose keys it uses on a secured domain

}  // namespace

int main(int argc, char** argv) {
  using namespace sls;
  CLI::App cli("Flies a scenario's mission: answers every state sample with a control force.");
  app::CommonOptions options;
  options.qos_file = bus::default_qos_file();
  std::filesystem::path scenario_file;
  std::string name = "control_client";
  std::int32_t strength = 0;
  std::string vehicles = "all";
  bool follows_servers = false;
  bool checks_purity = false;
  app::add_common_options(cli, options);
  cli.add_option("--scenario", scenario_file, "scenario (YAML), the same as the server's")
      ->type_name("FILE")
      ->required();
  cli.add_option("--strength", strength, "among several clients the strongest flies")
      ->type_name("N");
  cli.add_option("--vehicles", vehicles,
                 "of the fleet, such as 0-9,20; default: all that the server has")
      ->type_name("IDS");
  cli.add_flag("--follow", follows_servers,
               "fly on with a server that replaces this one; else end with exit code 1");
  cli.add_flag(
      "--check-purity", checks_purity,
      "compute every answer twice and refuse a law that gives two different ones; default: "
      "in the first 100 steps");
  cli.add_option("--name", name, "name in recordings and messages")
      ->check(CLI::Validator(
          [](const std::string& text) {
            const bool is_plain = std::all_of(text.begin(), text.end(), [](unsigned char letter) {
              return std::isalnum(letter) || letter == '_' || letter == '-' || letter == '.';
            });
            return text.empty() || text.size() > 32 || !is_plain
                       ? "expected 1 to 32 letters, digits, '_', '-' or '.', got '" + text + "'"
                       : std::string();
          },
          "TEXT"));

  return app::run_main(argc, argv, cli, options, "control_client", [&] {
    const config::Scenario scenario = config::load_scenario(scenario_file);
    const auto vehicle_ids = config::parse_vehicle_ids(vehicles, scenario.vehicles.size());
    // A law that cannot be made is refused before anybody waits for this client.
    control::FlightController(config::make_vehicle_scenario(scenario, vehicle_ids.front()),
                              vehicle_ids.front());
    bus::Node node(options.qos_file, options.domain, "control_client", kIdentity);
    control::Client(node, scenario, vehicle_ids, name, strength, follows_servers, checks_purity)
        .run();
  });
}
