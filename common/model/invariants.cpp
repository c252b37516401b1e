#include "common/model/invariants.hpp"

#include <cmath>

namespace sls::model {

double calc_energy(const SlungLoadState& state, const SlungLoadParameters& parameters) {
  const double m = parameters.quad_mass, m_L = parameters.load_mass;
  return 0.5 * m * state.v_WQ.squaredNorm() + 0.5 * m_L * state.v_WL.squaredNorm() -
         parameters.gravity * (m * state.p_WQ.z() + m_L * state.p_WL.z());
}

Eigen::Vector3d calc_momentum(const SlungLoadState& state, const SlungLoadParameters& parameters) {
  return parameters.quad_mass * state.v_WQ + parameters.load_mass * state.v_WL;
}

double calc_rod_length_error(const SlungLoadState& state, double rod_length) {
  return std::abs((state.p_WL - state.p_WQ).norm() - rod_length);
}

double calc_rod_stretch_rate(const SlungLoadState& state) {
  return std::abs((state.v_WL - state.v_WQ).dot((state.p_WL - state.p_WQ).normalized()));
}

}  // namespace sls::model
