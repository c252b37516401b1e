/// The scenario keys of the autopilot `geometric`.
#pragma once

#include <optional>

#include "common/config/scenario_keys.hpp"

namespace sls::sim::geometric {

struct Keys {
  std::optional<double> attitude;  ///< k_R, N·m; none: from the inertia
  std::optional<double> rate;      ///< k_Ω, N·m·s; none: from the inertia
};

template <class Map>
void describe_own(Map& map, config::Autopilot& autopilot, Keys& keys) {
  config::describe_period(map, autopilot);
  map.key(config::kOptional, "attitude_n_m", keys.attitude, config::kPositive);
  map.key(config::kOptional, "rate_n_m_s", keys.rate, config::kPositive);
}

}  // namespace sls::sim::geometric
