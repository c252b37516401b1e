/// Steps before and after a control law: the wiring of the rod angles that it receives, and the
/// compensation of drag and the limit of the force that it returns. Source: README.md, eqs. (14) to
/// (16).
#pragma once

#include <Eigen/Core>

#include "common/config/scenario.hpp"
#include "common/model/forces.hpp"
#include "common/model/math.hpp"
#include "common/model/state.hpp"

namespace sls::control {

/// The values that the law's slots (α, β, α̇, β̇) receive for the true rod angles. `gazebo_plugin`
/// reproduces the published plugin. `rod_length` is that of the plant, m.
inline model::RodAngles calc_wired_angles(const model::RodAngles& rod, config::StateWiring wiring,
                                          double rod_length) {
  if (wiring == config::StateWiring::kCorrect) return rod;
  // Eq. (14): angles exchanged, one sign wrong, velocities of the load instead of rates.
  model::RodAngles slots;
  slots.alpha = rod.beta;
  slots.beta = -rod.alpha;
  slots.alpha_dot = rod_length * rod.alpha_dot -
                    2.0 * rod_length * math::tan(rod.alpha) * math::tan(rod.beta) * rod.beta_dot;
  slots.beta_dot = rod_length * rod.beta_dot;
  return slots;
}

inline constexpr double kDragTolerance = 1e-12;  ///< of the change of F, relative to |F_qsf|
inline constexpr int kMaxDragIterations = 20;

/// Control force F with F + F_d(F) = `f_qsf_W`, where F_d is the rotor drag at F: force and drag
/// together are then the force of the law. Fixed-point iteration; if it does not converge, because
/// the drag is not small compared with the force, the last iterate.
inline Eigen::Vector3d calc_drag_feed_forward(const Eigen::Vector3d& f_qsf_W,
                                              const Eigen::Vector3d& v_WQ,
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

/// `f_Q_W` if its strength is at most `limit` (N); else a force of the same direction with the
/// strength `limit` (1 − 1e-12). With this margin, rounding never makes it stronger than the server
/// accepts.
inline Eigen::Vector3d calc_saturated(const Eigen::Vector3d& f_Q_W, double limit) {
  const double strength = f_Q_W.stableNorm();  // does not overflow
  if (strength <= limit) return f_Q_W;
  return f_Q_W / strength * (limit * (1.0 - 1e-12));  // Eq. (16)
}

}  // namespace sls::control
