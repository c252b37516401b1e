/// From the error of the attitude to body rates.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace sls::sim::px4 {

struct AttitudeGains {
  Eigen::Vector3d per_rad{6.5, 6.5, 2.8};  ///< rate per error, 1/s
  double yaw_weight = 0.4;                 ///< weight of the yaw error, 0 … 1
  Eigen::Vector3d rate_limits{3.8397243543875251, 3.8397243543875251,
                              3.4906585039886591};  ///< 220, 220 and 200 °/s, in rad/s
};

/// Set-points of the body rates (3×1, in B, rad/s) that turn B from `q_WB` to `q_WB_wanted`, unit
/// quaternions. Finite for every pair. Source: README.md, eqs. (3) to (6).
Eigen::Vector3d calc_rate_set_points(const Eigen::Quaterniond& q_WB,
                                     const Eigen::Quaterniond& q_WB_wanted,
                                     const AttitudeGains& gains);

}  // namespace sls::sim::px4
