/// The description of a message type for readers: its definition and its hash.
#pragma once

#include <string>

namespace sls::ros {

/// The text of idl/ros/messages.msg.
extern const char* const kMessageDefinitions;

/// The ros2msg schema of a type such as "nav_msgs/msg/Odometry": its definition, then those of its
/// parts, each after a line of 80 "=" and a line "MSG: package/Type".
/// @throws std::out_of_range if a type is not in idl/ros/messages.msg.
std::string make_schema(const std::string& type);

/// "RIHS01_…" (REP-2016) of a type that Mirrors writes. The table is checked by
/// tests/common/ros/type_hash_test.py.
/// @throws std::out_of_range for any other type.
std::string find_type_hash(const std::string& type);

}  // namespace sls::ros
