#include "common/model/forces.hpp"

#include "common/model/math.hpp"

namespace sls::model {

Eigen::Vector3d calc_rotor_drag(const Eigen::Vector3d& f_Q_W, const Eigen::Vector3d& v_WQ,
                                const Aerodynamics& air) {
  if (air.rotor_drag == 0.0 || f_Q_W.isZero(0.0)) return Eigen::Vector3d::Zero();
  const Eigen::Vector3d direction = f_Q_W.stableNormalized();
  const Eigen::Vector3d v_rel = v_WQ - air.v_wind_W;
  return -air.rotor_drag * (v_rel - direction * direction.dot(v_rel));
}

CommandedAttitude calc_commanded_attitude(const Eigen::Vector3d& f_Q_W) {
  CommandedAttitude attitude;
  if (f_Q_W.isZero(0.0)) return attitude;
  // asin(F_y / |F|) without the square of a tiny or huge force.
  attitude.roll = math::atan2(f_Q_W.y(), math::hypot(f_Q_W.x(), f_Q_W.z()));
  attitude.pitch = math::atan2(-f_Q_W.x(), -f_Q_W.z());
  return attitude;
}

}  // namespace sls::model
