#include "control_client/laws/error_integral.hpp"

#include <cmath>

namespace sls::control {

bool is_clamped(double integral, double rate) {
  return std::abs(integral) >= kIntegralLimit && integral * rate > 0.0;
}

Eigen::Vector3d calc_next_integral(const Eigen::Vector3d& integral, const Eigen::Vector3d& rate,
                                   double period) {
  return (integral + period * rate).cwiseMax(-kIntegralLimit).cwiseMin(kIntegralLimit);
}

}  // namespace sls::control
