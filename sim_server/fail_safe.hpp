#pragma once

#include <Eigen/Core>

#include "common/model/parameters.hpp"
#include "common/model/state.hpp"

namespace sls::sim {

/// Force (N, in W) that the server applies by itself when no controller has answered for too long:
/// it holds the weight (m + m_L) g and damps the quadrotor's velocity with a time constant of 1 s
/// of the whole mass; at most `force_limit` in norm. Source: README.md, eq. (5).
Eigen::Vector3d calc_fail_safe_force(const model::SlungLoadParameters& vehicle,
                                     const model::SlungLoadState& state, double force_limit);

}  // namespace sls::sim
