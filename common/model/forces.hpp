/// Forces on the quadrotor that plant, controller and recorder must agree on. Source: README.md.
#pragma once

#include <Eigen/Core>
#include <cmath>

#include "common/model/dot.hpp"
#include "common/model/math.hpp"
#include "common/model/parameters.hpp"

namespace sls::model {

/// Linear rotor drag on the quadrotor, N: −D Π (v − v_wind), Π projecting onto the plane normal to
/// the control force `f_Q_W`. Zero without a control force, because Π requires its direction.
/// Eq. (7).
inline Eigen::Vector3d calc_rotor_drag(const Eigen::Vector3d& f_Q_W, const Eigen::Vector3d& v_WQ,
                                       const Aerodynamics& air) {
  if (air.rotor_drag == 0.0 || f_Q_W.isZero(0.0)) return Eigen::Vector3d::Zero();
  const Eigen::Vector3d direction = f_Q_W.stableNormalized();
  const Eigen::Vector3d v_rel = v_WQ - air.v_wind_W;
  return -air.rotor_drag * (v_rel - direction * dot(direction, v_rel));
}

/// Drag of the load, N, where it moves with `v_WL` in a wind. Eq. (11).
inline Eigen::Vector3d calc_load_drag(const Eigen::Vector3d& v_WL, const Eigen::Vector3d& v_wind_W,
                                      const LoadDrag& drag) {
  const Eigen::Vector3d v_W = v_WL - v_wind_W;
  double factor = drag.linear;
  if (drag.area > 0.0) factor += 0.5 * drag.air_density * drag.area * std::sqrt(v_W.squaredNorm());
  return -factor * v_W;
}

/// Attitude a multirotor must take so that its thrust along −z of the body is `f_Q_W`.
struct CommandedAttitude {
  double roll = 0.0;   ///< rad, in [−π/2, π/2]
  double pitch = 0.0;  ///< rad, in (−π, π]
  double yaw = 0.0;    ///< rad, always 0: a point mass has no heading
};

/// F = −|F| R(roll, pitch, 0) e₃. Level for a zero force. Eq. (8).
inline CommandedAttitude calc_commanded_attitude(const Eigen::Vector3d& f_Q_W) {
  CommandedAttitude attitude;
  if (f_Q_W.isZero(0.0)) return attitude;
  // asin(F_y / |F|) without the square of a tiny or huge force.
  attitude.roll = math::atan2(f_Q_W.y(), math::hypot(f_Q_W.x(), f_Q_W.z()));
  attitude.pitch = math::atan2(-f_Q_W.x(), -f_Q_W.z());
  return attitude;
}

}  // namespace sls::model
