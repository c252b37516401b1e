#include "sim_server/plants/analytic/keys.hpp"

#include "common/config/own_keys.hpp"

namespace sls::sim {

const config::ModelKeys<config::Plant>& analytic_keys() {
  static const config::OwnKeys<config::Plant, AnalyticKeys> keys;
  return keys;
}

}  // namespace sls::sim
