#include "sim_server/autopilots/first_order/keys.hpp"

#include "common/config/own_keys.hpp"

namespace sls::sim {

const config::ModelKeys<config::Autopilot>& first_order_keys() {
  static const config::OwnKeys<config::Autopilot, FirstOrderKeys> keys;
  return keys;
}

}  // namespace sls::sim
