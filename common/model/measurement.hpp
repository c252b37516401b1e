/// The measurements of one vehicle at one instant.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "common/model/state.hpp"

namespace sls::model {

/// Maximum number of signals of a plant, and of numbers in a controller's memory.
inline constexpr int kMaxNumbers = 64;

/// Up to 64 numbers, stored without allocation.
using Numbers = Eigen::Matrix<double, Eigen::Dynamic, 1, Eigen::ColMajor, kMaxNumbers, 1>;

/// Attitude of the quadrotor's body B (x forward, y right, z down) in W. A point mass stays level.
struct Attitude {
  Eigen::Quaterniond q_WB = Eigen::Quaterniond::Identity();  ///< rotates vectors from B into W
  Eigen::Vector3d w_WB_B = Eigen::Vector3d::Zero();          ///< angular velocity in B, rad/s
};

struct Measurement : SlungLoadState {
  Measurement() = default;
  /// The measurement of a point mass: level, without signals.
  Measurement(const SlungLoadState& state) : SlungLoadState(state) {}

  Attitude attitude;
  Numbers signals;  ///< of the plant, in the order in which it describes them
};

}  // namespace sls::model
