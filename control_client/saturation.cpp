#include "control_client/saturation.hpp"

namespace sls::control {

Eigen::Vector3d calc_saturated(const Eigen::Vector3d& f_Q_W, double limit) {
  const double strength = f_Q_W.stableNorm();  // does not overflow
  if (strength <= limit) return f_Q_W;
  return f_Q_W / strength * (limit * (1.0 - 1e-12));  // Eq. (16)
}

}  // namespace sls::control
