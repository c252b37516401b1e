#include "control_client/laws/pid/keys.hpp"

#include "common/config/own_keys.hpp"

namespace sls::control {

const config::ModelKeys<config::Controller>& pid_keys() {
  static const config::OwnKeys<config::Controller, PidKeys> keys;
  return keys;
}

}  // namespace sls::control
