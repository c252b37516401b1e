#include "sim_server/autopilots/geometric/keys.hpp"

#include "common/config/own_keys.hpp"

namespace sls::sim {

const config::ModelKeys<config::Autopilot>& geometric_keys() {
  static const config::OwnKeys<config::Autopilot, geometric::Keys> keys;
  return keys;
}

}  // namespace sls::sim
