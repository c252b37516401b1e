/// The length of a cable over time: README.md, "Winch".
#pragma once

#include <cmath>
#include <vector>

#include "sim_server/plants/cables/keys.hpp"

namespace sls::sim::cables {

/// From `start` on the length has a constant acceleration, until the next phase.
struct WinchPhase {
  double start;         ///< s
  double length;        ///< at `start`, m
  double rate;          ///< at `start`, m/s
  double acceleration;  ///< m/s²
};

struct WinchLength {
  double length, rate;  ///< m, m/s
};

inline WinchLength calc_length(const WinchPhase& phase, double time) {
  const double since = time - phase.start;
  return {phase.length + since * (phase.rate + 0.5 * since * phase.acceleration),
          phase.rate + since * phase.acceleration};
}

/// The phases of a stage that begins at rest at `length`: eq. (12). The last one is its end, at
/// rest.
inline std::vector<WinchPhase> make_phases(const WinchStageKeys& stage, double length) {
  const double way = std::abs(stage.length - length), sign = stage.length < length ? -1.0 : 1.0;
  const double acceleration = sign * stage.acceleration;
  // The rate limit is reached if there is room to reach it and to stop again.
  const bool is_long = way * stage.acceleration > stage.rate * stage.rate;
  const double rate = is_long ? stage.rate : std::sqrt(way * stage.acceleration);
  const double ramp = rate / stage.acceleration, ramp_way = 0.5 * sign * rate * ramp;
  const double start = 1e-9 * static_cast<double>(stage.at_ns);
  std::vector<WinchPhase> phases;
  if (way > 0.0) phases.push_back({start, length, 0.0, acceleration});
  if (is_long) {
    phases.push_back({start + ramp, length + ramp_way, sign * rate, 0.0});
    const double cruise = way / rate - ramp;
    phases.push_back({start + ramp + cruise, stage.length - ramp_way, sign * rate, -acceleration});
    phases.push_back({start + 2.0 * ramp + cruise, stage.length, 0.0, 0.0});
  } else {
    if (way > 0.0) phases.push_back({start + ramp, length + ramp_way, sign * rate, -acceleration});
    phases.push_back({start + 2.0 * ramp, stage.length, 0.0, 0.0});
  }
  return phases;
}

}  // namespace sls::sim::cables
