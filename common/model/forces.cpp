#include "common/model/forces.hpp"

#include <cmath>

namespace sls::model {

Eigen::Vector3d calc_rotor_drag(const Eigen::Vector3d& f_Q_W, const Eigen::Vector3d& v_WQ,
                                const Aerodynamics& air) {
  const double force_squared = f_Q_W.squaredNorm();
  if (air.rotor_drag == 0.0 || force_squared == 0.0) return Eigen::Vector3d::Zero();
  const Eigen::Vector3d v_rel = v_WQ - air.v_wind_W;
  return -air.rotor_drag * (v_rel - f_Q_W * (f_Q_W.dot(v_rel) / force_squared));
}

CommandedAttitude calc_commanded_attitude(const Eigen::Vector3d& f_Q_W) {
  CommandedAttitude attitude;
  const double thrust = f_Q_W.norm();
  if (thrust == 0.0) return attitude;
  attitude.roll = std::asin(f_Q_W.y() / thrust);
  attitude.pitch = std::atan2(-f_Q_W.x(), -f_Q_W.z());
  return attitude;
}

}  // namespace sls::model
