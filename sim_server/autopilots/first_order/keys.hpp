/// The scenario keys of the autopilot `first_order`.
#pragma once

#include "common/config/scenario_keys.hpp"

namespace sls::sim {

struct FirstOrderKeys {
  double lag_s = 0.0;  ///< of the thrust's direction
};

template <class Map>
void describe_own(Map& map, config::Autopilot&, FirstOrderKeys& keys) {
  map.key(config::kRequired, "lag_s", keys.lag_s, config::kNotNegative);
}

}  // namespace sls::sim
