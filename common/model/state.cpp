#include "common/model/state.hpp"

#include <cmath>

#include "common/model/math.hpp"

namespace sls::model {

RodDirection to_direction(const RodAngles& angles) {
  const auto [sin_a, cos_a] = math::sincos(angles.alpha);
  const auto [sin_b, cos_b] = math::sincos(angles.beta);
  RodDirection direction;
  direction.n_W << sin_b, -sin_a * cos_b, cos_a * cos_b;  // Eq. (1)
  direction.n_dot_W << cos_b * angles.beta_dot,           // Eq. (2)
      -cos_a * cos_b * angles.alpha_dot + sin_a * sin_b * angles.beta_dot,
      -sin_a * cos_b * angles.alpha_dot - cos_a * sin_b * angles.beta_dot;
  return direction;
}

RodAngles to_angles(const RodDirection& direction) {
  const Eigen::Vector3d& n = direction.n_W;
  const Eigen::Vector3d& n_dot = direction.n_dot_W;
  RodAngles angles;
  // Eq. (3): asin(n_x) and asin(−n_y / cos β), written so that they keep full precision near ±π/2
  // and stay right when the load is above the quadrotor.
  const double cos_b = math::hypot(n.y(), n.z());
  angles.beta = math::atan2(n.x(), cos_b);
  angles.alpha = math::atan2(0.0 - n.y(), n.z());  // 0 − x: a hanging rod has no −0
  // Eq. (4), with the divisions by cos α and, for β̇, by cos β removed by (2).
  const auto [sin_a, cos_a] = math::sincos(angles.alpha);
  const double sin_b = math::sin(angles.beta);
  angles.beta_dot = cos_b * n_dot.x() + sin_b * (sin_a * n_dot.y() - cos_a * n_dot.z());
  angles.alpha_dot = (0.0 - cos_a * n_dot.y() - sin_a * n_dot.z()) / cos_b;
  return angles;
}

SlungLoadState make_state(const Eigen::Vector3d& p_WQ, const Eigen::Vector3d& v_WQ,
                          const RodAngles& rod, double rod_length) {
  const RodDirection direction = to_direction(rod);
  SlungLoadState state;
  state.p_WQ = p_WQ;
  state.v_WQ = v_WQ;
  state.p_WL = p_WQ + rod_length * direction.n_W;
  state.v_WL = v_WQ + rod_length * direction.n_dot_W;
  state.rod = rod;
  return state;
}

SlungLoadState make_state(const Eigen::Vector3d& p_WQ, const Eigen::Vector3d& v_WQ,
                          const Eigen::Vector3d& p_WL, const Eigen::Vector3d& v_WL) {
  const double length = (p_WL - p_WQ).norm();
  RodDirection direction;
  direction.n_W = (p_WL - p_WQ) / length;
  direction.n_dot_W = (v_WL - v_WQ) / length;  // a true angular rate: divided by L
  SlungLoadState state;
  state.p_WQ = p_WQ;
  state.v_WQ = v_WQ;
  state.p_WL = p_WL;
  state.v_WL = v_WL;
  state.rod = to_angles(direction);
  return state;
}

bool is_finite(const SlungLoadState& state) {
  return state.p_WQ.allFinite() && state.v_WQ.allFinite() && state.p_WL.allFinite() &&
         state.v_WL.allFinite() && std::isfinite(state.rod.alpha) &&
         std::isfinite(state.rod.beta) && std::isfinite(state.rod.alpha_dot) &&
         std::isfinite(state.rod.beta_dot);
}

}  // namespace sls::model
