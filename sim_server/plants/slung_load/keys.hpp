/// The scenario keys of the plant `slung_load`.
#pragma once

#include "common/config/scenario_keys.hpp"
#include "sim_server/plants/pendulum.hpp"

namespace sls::sim {

struct SlungLoadKeys {
  Pendulum pendulum = Pendulum::kIdeal;  ///< `rigid`: the published links
};

template <class Map>
void describe_own(Map& map, config::Plant& plant, SlungLoadKeys& keys) {
  map.key(config::kOptional, "pendulum", keys.pendulum);
  config::describe_point_mass_loads(map, plant);
}

}  // namespace sls::sim
