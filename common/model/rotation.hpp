/// Rotations, from angles by our own sine and cosine. Those of Eigen and Simbody call the C
/// library's.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "common/model/math.hpp"

namespace sls::model {

/// Turn by `angle` (rad) about the unit vector `axis`.
inline Eigen::Quaterniond make_turn(double angle, const Eigen::Vector3d& axis) {
  const math::SineCosine half = math::sincos(0.5 * angle);
  Eigen::Quaterniond turn;
  turn.w() = half.cosine;
  turn.vec() = half.sine * axis;
  return turn;
}

/// Turn by `yaw` about z, then by `pitch` about the new y, then by `roll` about the new x; rad.
inline Eigen::Quaterniond make_attitude(double roll, double pitch, double yaw) {
  return make_turn(yaw, Eigen::Vector3d::UnitZ()) * make_turn(pitch, Eigen::Vector3d::UnitY()) *
         make_turn(roll, Eigen::Vector3d::UnitX());
}

/// The vector v of the antisymmetric part of `m`, whose product with x is v × x. Of a rotation it
/// is the axis times the sine of the angle.
inline Eigen::Vector3d calc_antisymmetric_vector(const Eigen::Matrix3d& m) {
  return 0.5 * Eigen::Vector3d(m(2, 1) - m(1, 2), m(0, 2) - m(2, 0), m(1, 0) - m(0, 1));
}

}  // namespace sls::model
