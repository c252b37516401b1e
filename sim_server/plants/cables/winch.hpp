/// The length of a cable over time: README.md, "Winch".
#pragma once

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

WinchLength calc_length(const WinchPhase& phase, double time);

/// The phases of a stage that begins at rest at `length`: eq. (12). The last one is its end, at
/// rest.
std::vector<WinchPhase> make_phases(const WinchStageKeys& stage, double length);

}  // namespace sls::sim::cables
