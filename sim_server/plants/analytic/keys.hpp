/// The scenario keys of the plant `analytic`.
#pragma once

#include "common/config/scenario_keys.hpp"

namespace sls::sim {

struct AnalyticKeys {};

template <class Map>
void describe_own(Map& map, config::Plant& plant, AnalyticKeys&) {
  config::describe_point_mass_loads(map, plant);
}

}  // namespace sls::sim
