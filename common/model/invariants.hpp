/// Quantities that motion conserves or constrains, for tests and the server's self-check.
#pragma once

#include <Eigen/Core>

#include "common/model/parameters.hpp"
#include "common/model/state.hpp"

namespace sls::model {

/// Kinetic plus potential energy, J; height is −z, zero at z = 0. For point masses.
double calc_energy(const SlungLoadState& state, const SlungLoadParameters& parameters);

/// m v_WQ + m_L v_WL, kg·m/s.
Eigen::Vector3d calc_momentum(const SlungLoadState& state, const SlungLoadParameters& parameters);

/// | |p_WL − p_WQ| − L |, m.
double calc_rod_length_error(const SlungLoadState& state, double rod_length);

/// |(v_WL − v_WQ) · n_W|, m/s: the speed at which the rod would be stretched.
double calc_rod_stretch_rate(const SlungLoadState& state);

}  // namespace sls::model
