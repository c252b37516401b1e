#pragma once

#include <Eigen/Core>

#include "common/model/parameters.hpp"
#include "common/model/state.hpp"

namespace sls::sim {

/// Force (N, in W) that the server applies when no controller has answered for too long. It holds
/// the weight (m + m_L) g and damps the quadrotor's velocity; the time constant of the whole mass
/// is 1 s. Its norm is at most `force_limit`. Source: sim_server/README.md, eq. (5).
Eigen::Vector3d calc_fail_safe_force(const model::SlungLoadParameters& vehicle,
                                     const model::SlungLoadState& state, double force_limit);

}  // namespace sls::sim
