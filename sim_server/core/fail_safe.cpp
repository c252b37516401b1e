#include "sim_server/core/fail_safe.hpp"

namespace sls::sim {

Eigen::Vector3d calc_fail_safe_force(const model::SlungLoadParameters& vehicle,
                                     const model::SlungLoadState& state, double force_limit) {
  constexpr double kTimeConstant = 1.0;  // s
  const double mass = vehicle.quad_mass + vehicle.load_mass;
  const Eigen::Vector3d f_Q_W =
      -mass * (vehicle.gravity * Eigen::Vector3d::UnitZ() + state.v_WQ / kTimeConstant);
  const double norm = f_Q_W.norm();
  return norm > force_limit ? Eigen::Vector3d(f_Q_W * (force_limit / norm)) : f_Q_W;
}

}  // namespace sls::sim
