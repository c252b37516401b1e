/// Limits the force if the scenario has `controller.saturate`. Source: README.md, eq. (16).
#pragma once

#include <Eigen/Core>

namespace sls::control {

/// `f_Q_W` if its strength is at most `limit` (N); else a force of the same direction with the
/// strength `limit` (1 − 1e-12). With this margin, rounding never makes it stronger than the server
/// accepts.
Eigen::Vector3d calc_saturated(const Eigen::Vector3d& f_Q_W, double limit);

}  // namespace sls::control
