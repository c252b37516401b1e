/// Errors of what is measured: numbers that are added, and an attitude that is turned. Source:
/// README.md.
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

/// Whether any of `rod` is other than 0.
bool moves_rod(const RodAngles& rod);

/// `state` with `offset` added. Attitude and signals stay as they are, and so does every bit of the
/// rod's where `offset.rod` is 0. `rod_length` (m) counts where it is not.
Measurement add(const Measurement& state, const StateOffset& offset, double rod_length);

/// Constant error of a measured attitude.
struct AttitudeError {
  Eigen::Vector2d tilt = Eigen::Vector2d::Zero();  ///< about x and y, rad
  double yaw = 0.0;                                ///< about z, rad

  bool is_zero() const { return tilt.isZero(0.0) && yaw == 0.0; }
};

/// The attitude that is measured where `q_WB` is true. Source: README.md, eq. (9).
Eigen::Quaterniond turn(const Eigen::Quaterniond& q_WB, const AttitudeError& error);

}  // namespace sls::model
