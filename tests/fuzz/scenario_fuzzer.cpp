/// Any text is a scenario or causes a ConfigError. A scenario that is written and read again is the
/// same.
#include <cstdint>
#include <cstdlib>
#include <string>

#include "common/config/config_error.hpp"
#include "common/config/scenario.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace sls;
  config::Scenario scenario;
  try {
    scenario = config::parse_scenario(std::string(data, data + size), "input");
  } catch (const config::ConfigError&) {
    return 0;
  }
  const std::string written = config::to_yaml(scenario);
  if (written.size() > config::kMaxScenarioBytes) return 0;
  if (config::to_yaml(config::parse_scenario(written, "written")) != written) std::abort();
  return 0;
}
