/// The scenario keys of the law `cooperative`.
#pragma once

#include "common/config/scenario_keys.hpp"

namespace sls::control {

/// README.md, "Gains".
struct CooperativeGains {
  double position = 4.0;  ///< 1/s²: acceleration of the load per error of its position
  double velocity = 4.0;  ///< 1/s
  double attitude = 9.0;  ///< 1/s²: angular acceleration of the load per error of its attitude
  double rates = 6.0;     ///< 1/s
  double cable_angle = 225.0;  ///< 1/s²: angular acceleration of a cable per error of its direction
  double cable_rate = 30.0;    ///< 1/s
};

struct CooperativeKeys {
  CooperativeGains gains;
  double spread = 0.0;  ///< angle of the outermost cables from the vertical at rest, rad
};

inline constexpr config::NumberRule kSpread{"radians from 0 to 1.4",
                                            [](double x) { return x >= 0.0 && x <= 1.4; }};

template <class Map>
void describe(Map& map, CooperativeGains& gains) {
  map.key(config::kRequired, "position", gains.position, config::kPositive);
  map.key(config::kRequired, "velocity", gains.velocity, config::kPositive);
  map.key(config::kRequired, "attitude", gains.attitude, config::kPositive);
  map.key(config::kRequired, "rates", gains.rates, config::kPositive);
  map.key(config::kRequired, "cable_angle", gains.cable_angle, config::kPositive);
  map.key(config::kRequired, "cable_rate", gains.cable_rate, config::kPositive);
}

template <class Map>
void describe_own(Map& map, config::Controller&, CooperativeKeys& keys) {
  map.key(config::kOptional, "gains", keys.gains);
  map.key(config::kOptional, "spread_rad", keys.spread, kSpread);
}

}  // namespace sls::control
