/// Converts vectors and attitudes of this project (z down) to those of ROS (z up, REP-103):
/// README.md. No other code converts them.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <string>

namespace sls::ros {

inline const std::string kWorld = "world";              ///< x forward, y left, z up
inline const std::string kWorldZDown = "world_z_down";  ///< frame W of this project

/// "vehicle_3": prefix of names of topics, frames and markers.
inline std::string name_vehicle(std::uint32_t vehicle_id) {
  return "vehicle_" + std::to_string(vehicle_id);
}
/// Frame of the quadrotor's body: x forward, y left, z up.
inline std::string name_quadrotor_frame(std::uint32_t vehicle_id) {
  return name_vehicle(vehicle_id) + "/quadrotor";
}
/// Frame at the load, parallel to `world`.
inline std::string name_load_frame(std::uint32_t vehicle_id) {
  return name_vehicle(vehicle_id) + "/load";
}

/// A vector in W or in the body frame (z down) → the same in the frame of ROS (z up): half a turn
/// about x. No element is −0.0.
inline Eigen::Vector3d to_ros(const Eigen::Vector3d& v) {
  return {v.x() + 0.0, -v.y() + 0.0, -v.z() + 0.0};
}

/// The attitude q_WB of a body → that of its frame in ROS. Half a turn about x of both frames:
/// d q d⁻¹ with d = (0, 1, 0, 0). No element is −0.0.
inline Eigen::Quaterniond to_ros(const Eigen::Quaterniond& q) {
  return {q.w() + 0.0, q.x() + 0.0, -q.y() + 0.0, -q.z() + 0.0};
}

/// The attitude of `world_z_down` in `world`.
inline Eigen::Quaterniond half_turn_about_x() { return {0, 1, 0, 0}; }

}  // namespace sls::ros
