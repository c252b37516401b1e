#include "common/model/offset.hpp"

#include "common/model/rotation.hpp"

namespace sls::model {

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
  moved.rod.alpha += offset.rod.alpha;
  moved.rod.beta += offset.rod.beta;
  moved.rod.alpha_dot += offset.rod.alpha_dot;
  moved.rod.beta_dot += offset.rod.beta_dot;
  static_cast<SlungLoadState&>(moved) = make_state(moved.p_WQ, moved.v_WQ, moved.rod, rod_length);
  return moved;
}

Eigen::Quaterniond turn(const Eigen::Quaterniond& q_WB, const AttitudeError& error) {
  using Eigen::Vector3d;
  const Eigen::Quaterniond seen_from_true = make_turn(error.yaw, Vector3d::UnitZ()) *
                                            make_turn(error.tilt.y(), Vector3d::UnitY()) *
                                            make_turn(error.tilt.x(), Vector3d::UnitX());
  return seen_from_true * q_WB;  // Eq. (9)
}

}  // namespace sls::model
