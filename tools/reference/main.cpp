// Prints every key of a scenario as JSON: what docs/reference/scenario.md is made from.
#include <iostream>
#include <nlohmann/json.hpp>

#include "common/config/key_lister.hpp"

int main() {
  auto keys = nlohmann::ordered_json::array();
  for (const auto& key : sls::config::list_scenario_keys())
    keys.push_back({{"path", key.path},
                    {"type", key.type},
                    {"range", key.range},
                    {"default", key.default_value},
                    {"presence", key.presence},
                    {"condition", key.condition}});
  std::cout << keys.dump(2) << '\n';
}
