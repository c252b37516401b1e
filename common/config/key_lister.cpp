#include "common/config/key_lister.hpp"

namespace sls::config {

std::vector<ListedKey> list_scenario_keys(const Models& models) {
  std::vector<ListedKey> keys;
  Alternatives alternatives;
  KeyLister lister(keys, models, "", alternatives);
  Scenario scenario;
  describe(lister, scenario);
  return keys;
}

}  // namespace sls::config
