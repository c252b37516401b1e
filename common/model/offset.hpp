/// Measurement errors: added numbers and a turned attitude. Source: README.md.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "common/model/measurement.hpp"

namespace sls::model {

/// Numbers added to a state.
struct StateOffset {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  ///< of quadrotor and load alike, m
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();  ///< of quadrotor and load alike, m/s
  RodAngles rod;                                       ///< rad, rad/s; the load moves accordingly
};

/// True if any number of `rod` is not 0.
bool moves_rod(const RodAngles& rod);

/// `state` with `offset` added. Attitude and signals do not change. If `offset.rod` is 0, the rod's
/// angles and rates keep every bit; else the load moves with the rod of length `rod_length` (m),
/// whose joint stays where it is relative to the quadrotor.
Measurement add(const Measurement& state, const StateOffset& offset, double rod_length);

/// Constant error of a measured attitude.
struct AttitudeError {
  Eigen::Vector2d tilt = Eigen::Vector2d::Zero();  ///< about x and y, rad
  double yaw = 0.0;                                ///< about z, rad

  bool is_zero() const { return tilt.isZero(0.0) && yaw == 0.0; }
};

/// The measured attitude if the true one is `q_WB`. Source: README.md, eq. (9).
Eigen::Quaterniond turn(const Eigen::Quaterniond& q_WB, const AttitudeError& error);

}  // namespace sls::model
