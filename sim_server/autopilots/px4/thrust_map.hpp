/// From a force to the normalised thrust, and from outputs to speeds of the rotors.
#pragma once

#include <vector>

#include "sim_server/autopilots/autopilot.hpp"
#include "sim_server/autopilots/px4/mixer.hpp"

namespace sls::sim::px4 {

/// A straight line through one point: README.md, eq. (2). The numbers are the published ones.
struct AffineThrust {
  double force = 16.67122;         ///< of the point, N
  double thrust = 0.8168;          ///< of the point, normalised
  double force_per_thrust = 20.0;  ///< N
};

/// Speed of a rotor as a function of its output: README.md, eq. (14).
struct SpeedMap {
  double speed_at_zero = 100.0;      ///< rad/s
  double speed_per_output = 1000.0;  ///< rad/s
};

/// Normalised thrust for `force` (N), 0 … 1.
double calc_affine_thrust(const AffineThrust& map, double force);

/// Exact inverse of the lift of the rotors, level and at rest: README.md, eq. (1).
class ExactThrust {
 public:
  /// @throws std::invalid_argument if the lift does not grow with the normalised thrust.
  ExactThrust(const std::vector<Rotor>& rotors, const std::vector<MixerRow>& mixer,
              const SpeedMap& speeds);
  /// Normalised thrust for `force` (N), 0 … 1.
  double calc_thrust(double force) const;

 private:
  // Coefficients of the force as a polynomial in the normalised thrust.
  double square_ = 0.0, linear_ = 0.0, constant_ = 0.0;
};

}  // namespace sls::sim::px4
