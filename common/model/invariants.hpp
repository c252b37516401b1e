/// Quantities that motion conserves or constrains, for tests and the server's self-check.
#pragma once

#include <Eigen/Core>
#include <cmath>

#include "common/model/dot.hpp"
#include "common/model/parameters.hpp"
#include "common/model/state.hpp"

namespace sls::model {

/// Kinetic plus potential energy, J; height is −z, zero at z = 0. For point masses.
inline double calc_energy(const SlungLoadState& state, const SlungLoadParameters& parameters) {
  const double m = parameters.quad_mass, m_L = parameters.load_mass;
  return 0.5 * m * state.v_WQ.squaredNorm() + 0.5 * m_L * state.v_WL.squaredNorm() -
         parameters.gravity * (m * state.p_WQ.z() + m_L * state.p_WL.z());
}

/// m v_WQ + m_L v_WL, kg·m/s.
inline Eigen::Vector3d calc_momentum(const SlungLoadState& state,
                                     const SlungLoadParameters& parameters) {
  return parameters.quad_mass * state.v_WQ + parameters.load_mass * state.v_WL;
}

/// | |p_WL − p_WQ| − L |, m.
inline double calc_rod_length_error(const SlungLoadState& state, double rod_length) {
  return std::abs((state.p_WL - state.p_WQ).norm() - rod_length);
}

/// |(v_WL − v_WQ) · n_W|, m/s: the speed at which the rod would be stretched.
inline double calc_rod_stretch_rate(const SlungLoadState& state) {
  return std::abs(dot(state.v_WL - state.v_WQ, (state.p_WL - state.p_WQ).normalized()));
}

}  // namespace sls::model
