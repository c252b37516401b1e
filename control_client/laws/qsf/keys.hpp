/// The scenario keys of the law `qsf`.
#pragma once

#include <optional>
#include <variant>

#include "common/config/scenario_keys.hpp"

namespace sls::control {

/// Gains of one output axis, named after the error that they multiply. The vertical chain has no
/// acceleration and jerk gain: they stay 0.
struct AxisGains {
  double position = 0.0;
  double velocity = 0.0;
  double acceleration = 0.0;
  double jerk = 0.0;
  double integral = 0.0;
};

struct NamedGains {
  AxisGains horizontal;
  AxisGains vertical;
};

/// Gains from LQR on the integrator chains, Q = weight · I, R = 1.
struct LqrWeights {
  double horizontal = 10.0;
  double vertical = 5.0;
};

using Gains = std::variant<LqrWeights, NamedGains>;

template <class Map>
void describe(Map& map, LqrWeights& weights) {
  map.key(config::kRequired, "horizontal", weights.horizontal, config::kPositive);
  map.key(config::kRequired, "vertical", weights.vertical, config::kPositive);
}

enum class Axis { kHorizontal, kVertical };

template <class Map>
void describe(Map& map, AxisGains& gains, Axis axis) {
  map.key(config::kRequired, "position", gains.position, config::kNotNegative);
  map.key(config::kRequired, "velocity", gains.velocity, config::kNotNegative);
  if (axis == Axis::kHorizontal) {
    map.key(config::kRequired, "acceleration", gains.acceleration, config::kNotNegative);
    map.key(config::kRequired, "jerk", gains.jerk, config::kNotNegative);
  }
  map.key(config::kOptional, "integral", gains.integral, config::kNotNegative);
}

template <class Map>
void describe(Map& map, Gains& gains) {
  bool by_lqr = std::holds_alternative<LqrWeights>(gains);
  map.choose(by_lqr, {{true, {"lqr"}}, {false, {"horizontal", "vertical"}}});
  if (by_lqr) {
    map.key(config::kRequired, "lqr", config::as<LqrWeights>(gains));
  } else {
    map.key(config::kRequired, "horizontal", config::as<NamedGains>(gains).horizontal,
            Axis::kHorizontal);
    map.key(config::kRequired, "vertical", config::as<NamedGains>(gains).vertical, Axis::kVertical);
  }
}

struct QsfKeys {
  Gains gains = LqrWeights{};
  std::optional<double> retaut_rate = {};  ///< m/s; none: no rule for slack cables
};

template <class Map>
void describe_own(Map& map, config::Controller&, QsfKeys& keys) {
  map.key(config::kOptional, "gains", keys.gains);
  map.key(config::kOptional, "retaut_rate_m_s", keys.retaut_rate, config::kPositive);
}

}  // namespace sls::control
