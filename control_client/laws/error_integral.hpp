/// The integral of the load position error. Source: control_client/laws/qsf/README.md,
/// eq. (10).
#pragma once

#include <Eigen/Core>
#include <cmath>

namespace sls::control {

inline constexpr double kIntegralLimit = 20.0;  ///< m·s, each axis

/// True when the integral is at its limit and `rate` would move it beyond: it then stays constant.
inline bool is_clamped(double integral, double rate) {
  return std::abs(integral) >= kIntegralLimit && integral * rate > 0.0;
}

/// The integral one period later: a forward Euler step, clamped on each axis.
inline Eigen::Vector3d calc_next_integral(const Eigen::Vector3d& integral,
                                          const Eigen::Vector3d& rate, double period) {
  return (integral + period * rate).cwiseMax(-kIntegralLimit).cwiseMin(kIntegralLimit);
}

}  // namespace sls::control
