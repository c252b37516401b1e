#include "common/config/key_lister.hpp"

namespace sls::config {

std::vector<ListedKey> list_scenario_keys(const Models& models) {
  return list_keys_of<Scenario>(models);
}

}  // namespace sls::config
