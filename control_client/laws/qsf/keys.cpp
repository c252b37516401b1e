#include "control_client/laws/qsf/keys.hpp"

#include "common/config/own_keys.hpp"

namespace sls::control {

const config::ModelKeys<config::Controller>& qsf_keys() {
  static const config::OwnKeys<config::Controller, QsfKeys> keys;
  return keys;
}

}  // namespace sls::control
