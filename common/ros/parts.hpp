/// Parts of several messages, with the fields in the order of idl/ros/messages.msg.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <string_view>

#include "common/ros/cdr_writer.hpp"

namespace sls::ros {

/// Position and attitude in a frame of ROS.
struct Pose {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
  Eigen::Quaterniond orientation = Eigen::Quaterniond::Identity();
};

/// builtin_interfaces/Time of a time since the beginning of the run.
inline void write_time(CdrWriter& cdr, std::int64_t time_ns) {
  constexpr std::int64_t kSecond = 1'000'000'000;
  const std::int64_t rest = (time_ns % kSecond + kSecond) % kSecond;
  cdr.write(static_cast<std::int32_t>((time_ns - rest) / kSecond));
  cdr.write(static_cast<std::uint32_t>(rest));
}

/// std_msgs/Header.
inline void write_header(CdrWriter& cdr, std::int64_t time_ns, std::string_view frame) {
  write_time(cdr, time_ns);
  cdr.write(frame);
}

/// geometry_msgs/Point and geometry_msgs/Vector3.
inline void write_vector(CdrWriter& cdr, const Eigen::Vector3d& vector) {
  cdr.write(vector.x());
  cdr.write(vector.y());
  cdr.write(vector.z());
}

/// geometry_msgs/Pose, and geometry_msgs/Transform to that pose.
inline void write_pose(CdrWriter& cdr, const Pose& pose) {
  write_vector(cdr, pose.position);
  cdr.write(pose.orientation.x());
  cdr.write(pose.orientation.y());
  cdr.write(pose.orientation.z());
  cdr.write(pose.orientation.w());
}

}  // namespace sls::ros
