/// The scenario keys of the plant `slung_load`.
#pragma once

#include <array>

#include "common/config/scenario_keys.hpp"

namespace sls::sim {

enum class Pendulum {
  kIdeal,  ///< point load on a massless rod
  kRigid,  ///< the published links: base, rod with inertia, load with inertia
};
inline std::array<config::Name<Pendulum>, 2> names_of(Pendulum) {
  return {{{"ideal", Pendulum::kIdeal}, {"rigid", Pendulum::kRigid}}};
}

struct SlungLoadKeys {
  Pendulum pendulum = Pendulum::kIdeal;
};

template <class Map>
void describe_own(Map& map, config::Plant& plant, SlungLoadKeys& keys) {
  map.key(config::kOptional, "pendulum", keys.pendulum);
  config::describe_point_mass_loads(map, plant);
}

}  // namespace sls::sim
