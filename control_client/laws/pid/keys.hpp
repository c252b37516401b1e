/// The scenario keys of the law `pid`.
#pragma once

#include "common/config/scenario_keys.hpp"

namespace sls::control {

/// Gains of one axis, from the outermost loop inwards. The vertical axis has no rod.
struct PidAxisGains {
  double position = 0.0;   ///< 1/s: desired velocity per position error
  double velocity = 0.0;   ///< 1/s: desired acceleration per velocity error
  double integral = 0.0;   ///< 1/s³: desired acceleration per integral of the position error
  double rod_angle = 0.0;  ///< 1/s²: rod acceleration per error of its slope
  double rod_rate = 0.0;   ///< 1/s: rod acceleration per rate of its slope
};

struct PidGains {
  PidAxisGains horizontal{0.6, 1.5, 0.05, 36.0, 12.0};
  PidAxisGains vertical{1.5, 3.0, 0.5, 0.0, 0.0};
};

struct PidKeys {
  PidGains gains;
};

template <class Map>
void describe(Map& map, PidAxisGains& gains, bool has_rod) {
  map.key(config::kRequired, "position", gains.position, config::kNotNegative);
  map.key(config::kRequired, "velocity", gains.velocity, config::kNotNegative);
  map.by_default(gains.integral, 0.0);
  map.key(config::kOptional, "integral", gains.integral, config::kNotNegative);
  if (!has_rod) return;
  map.key(config::kRequired, "rod_angle", gains.rod_angle, config::kNotNegative);
  map.key(config::kRequired, "rod_rate", gains.rod_rate, config::kNotNegative);
}

template <class Map>
void describe(Map& map, PidGains& gains) {
  map.key(config::kRequired, "horizontal", gains.horizontal, true);
  map.key(config::kRequired, "vertical", gains.vertical, false);
}

template <class Map>
void describe_own(Map& map, config::Controller&, PidKeys& keys) {
  map.key(config::kOptional, "gains", keys.gains);
}

}  // namespace sls::control
