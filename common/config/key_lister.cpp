#include "common/config/key_lister.hpp"

namespace sls::config {

std::vector<ListedKey> list_scenario_keys() {
  std::vector<ListedKey> keys;
  Alternatives alternatives;
  KeyLister lister(keys, "", alternatives);
  Scenario scenario;
  describe(lister, scenario);
  return keys;
}

}  // namespace sls::config
