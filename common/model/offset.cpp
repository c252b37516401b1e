#include "common/model/offset.hpp"

#include "common/model/rotation.hpp"

namespace sls::model {
namespace {

/// 0 for a vector that is only the rounding of positions or velocities: a rod from the quadrotor's
/// origin then gives the load that the angles alone give, bit for bit.
Eigen::Vector3d remove_rounding(const Eigen::Vector3d& difference) {
  constexpr double kRounding = 1e-9;  // m, m/s
  return difference.norm() > kRounding ? difference : Eigen::Vector3d::Zero();
}

}  // namespace

bool moves_rod(const RodAngles& rod) {
  return rod.alpha != 0.0 || rod.beta != 0.0 || rod.alpha_dot != 0.0 || rod.beta_dot != 0.0;
}

Measurement add(const Measurement& state, const StateOffset& offset, double rod_length) {
  Measurement moved = state;
  moved.p_WQ += offset.position;
  moved.v_WQ += offset.velocity;
  moved.p_WL += offset.position;
  moved.v_WL += offset.velocity;
  if (!moves_rod(offset.rod)) return moved;
  const SlungLoadState at_origin = make_state(state.p_WQ, state.v_WQ, state.rod, rod_length);
  const Eigen::Vector3d p_QJ_W = remove_rounding(state.p_WL - at_origin.p_WL);
  const Eigen::Vector3d v_QJ_W = remove_rounding(state.v_WL - at_origin.v_WL);
  moved.rod.alpha += offset.rod.alpha;
  moved.rod.beta += offset.rod.beta;
  moved.rod.alpha_dot += offset.rod.alpha_dot;
  moved.rod.beta_dot += offset.rod.beta_dot;
  static_cast<SlungLoadState&>(moved) = make_state(moved.p_WQ, moved.v_WQ, moved.rod, rod_length);
  moved.p_WL += p_QJ_W;
  moved.v_WL += v_QJ_W;
  return moved;
}

Eigen::Quaterniond turn(const Eigen::Quaterniond& q_WB, const AttitudeError& error) {
  return make_attitude(error.tilt.x(), error.tilt.y(), error.yaw) * q_WB;  // Eq. (9)
}

}  // namespace sls::model
