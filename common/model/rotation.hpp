/// Rotations from angles, by our own sine and cosine. Those of Eigen and Simbody call the C
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

}  // namespace sls::model
