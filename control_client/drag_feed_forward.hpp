/// Compensation of rotor drag. Source: README.md, eq. (15).
#pragma once

#include <Eigen/Core>

#include "common/model/parameters.hpp"

namespace sls::control {

inline constexpr double kDragTolerance = 1e-12;  ///< of the change of F, relative to |F_qsf|
inline constexpr int kMaxDragIterations = 20;

/// Control force F with F + F_d(F) = `f_qsf_W`, where F_d is the rotor drag at F: force and drag
/// together are then the force of the law. Fixed-point iteration; if it does not converge, because
/// the drag is not small compared with the force, the last iterate.
Eigen::Vector3d calc_drag_feed_forward(const Eigen::Vector3d& f_qsf_W, const Eigen::Vector3d& v_WQ,
                                       const model::Aerodynamics& air);

}  // namespace sls::control
