/// Allocates a moment and a thrust to the rotors.
#pragma once

#include <Eigen/Core>

#include "sim_server/autopilots/autopilot.hpp"

namespace sls::sim::geometric {

/// README.md, "Allocation".
class Allocation {
 public:
  /// @throws config::ConfigError if the rotors cannot roll or pitch the body.
  explicit Allocation(const AutopilotSetup& setup);

  /// Thrusts of the rotors (N), each from 0 to its largest, that together make `moment` (in B about
  /// the centre of mass, N·m) and `thrust` (along −z, N). If the limits do not allow both, roll and
  /// pitch have priority, then the thrust, then yaw.
  Eigen::VectorXd calc_thrusts(const Eigen::Vector3d& moment, double thrust) const;

 private:
  Eigen::Matrix<double, Eigen::Dynamic, 4> shares_;  // of roll, pitch, yaw, thrust
  Eigen::VectorXd largest_;                          // thrust of each rotor, N
};

}  // namespace sls::sim::geometric
