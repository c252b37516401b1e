/// Compensation of rotor drag. Source: README.md, eq. (15).
#pragma once

#include <Eigen/Core>

#include "common/model/parameters.hpp"

namespace sls::control {

inline constexpr double kDragTolerance = 1e-12;  ///< of |F_qsf|, on the change of F
inline constexpr int kMaxDragIterations = 20;

/// Control force F with F + F_d(F) = `f_qsf_W`, F_d the rotor drag it brings about: after the drag
/// the quadrotor feels what the law asked for. Fixed point; where drag is not small against the
/// force, the last of the iterates.
Eigen::Vector3d calc_drag_feed_forward(const Eigen::Vector3d& f_qsf_W, const Eigen::Vector3d& v_WQ,
                                       const model::Aerodynamics& air);

}  // namespace sls::control
