/// Limiting the force, where a scenario asks for it. Source: README.md, eq. (16).
#pragma once

#include <Eigen/Core>

namespace sls::control {

/// `f_Q_W` if its strength is at most `limit` (N), else the same direction with that strength, less
/// 1e-12 of it so that rounding never lifts it over what the server accepts.
Eigen::Vector3d calc_saturated(const Eigen::Vector3d& f_Q_W, double limit);

}  // namespace sls::control
