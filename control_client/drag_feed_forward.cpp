#include "control_client/drag_feed_forward.hpp"

#include "common/model/forces.hpp"

namespace sls::control {

Eigen::Vector3d calc_drag_feed_forward(const Eigen::Vector3d& f_qsf_W, const Eigen::Vector3d& v_WQ,
                                       const model::Aerodynamics& air) {
  const double tolerance = kDragTolerance * f_qsf_W.norm();
  Eigen::Vector3d force = f_qsf_W;
  for (int iteration = 0; iteration < kMaxDragIterations; ++iteration) {
    // Eq. (15). The change is the residual of the previous iterate.
    const Eigen::Vector3d next = f_qsf_W - model::calc_rotor_drag(force, v_WQ, air);
    const double change = (next - force).norm();
    force = next;
    if (change <= tolerance) break;
  }
  return force;
}

}  // namespace sls::control
