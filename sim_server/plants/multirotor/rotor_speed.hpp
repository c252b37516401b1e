/// How fast a rotor turns at one instant.
#pragma once

#include <vector>

namespace sls::sim {

/// Speed of a rotor, and the square of the speed from which its thrust is computed.
struct RotorSpeed {
  double speed;   ///< rad/s
  double square;  ///< rad²/s²
};

/// Of several rotors, one after the other.
using RotorSpeeds = std::vector<RotorSpeed>;

}  // namespace sls::sim
