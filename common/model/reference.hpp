/// The desired motion of the load at one instant.
#pragma once

#include <Eigen/Core>

namespace sls::model {

/// Desired load position y_r in W and its exact time derivatives.
struct Reference {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();      ///< m
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();      ///< m/s
  Eigen::Vector3d acceleration = Eigen::Vector3d::Zero();  ///< m/s²
  Eigen::Vector3d jerk = Eigen::Vector3d::Zero();          ///< m/s³
  Eigen::Vector3d snap = Eigen::Vector3d::Zero();          ///< m/s⁴
};

}  // namespace sls::model
