#include "common/ros/schemas.hpp"

#include <algorithm>
#include <map>
#include <sstream>
#include <vector>

namespace sls::ros {
namespace {

const std::string kSeparator = std::string(80, '=') + "\n";

/// The lines of each definition in `kMessageDefinitions`, by name ("geometry_msgs/Point").
std::map<std::string, std::string> split_definitions() {
  std::map<std::string, std::string> definitions;
  const std::string text = kMessageDefinitions;
  const std::string head = kSeparator + "MSG: ";
  for (std::size_t at = text.find(head); at != std::string::npos;) {
    const std::size_t name = at + head.size();
    const std::size_t body = text.find('\n', name) + 1;
    at = text.find(head, body);
    definitions[text.substr(name, body - 1 - name)] = text.substr(body, at - body);
  }
  return definitions;
}

/// The field types of a definition that are messages: "package/Type".
std::vector<std::string> list_parts(const std::string& definition) {
  std::vector<std::string> parts;
  std::istringstream lines(definition);
  for (std::string line; std::getline(lines, line);) {
    const std::string type = line.substr(0, line.find_first_of(" ["));
    if (type.find('/') != std::string::npos) parts.push_back(type);
  }
  return parts;
}

}  // namespace

std::string make_schema(const std::string& type) {
  static const auto definitions = split_definitions();
  const std::string short_name = type.substr(0, type.find('/')) + type.substr(type.rfind('/'));
  std::vector<std::string> types = {short_name};
  std::string schema;
  for (std::size_t i = 0; i < types.size(); ++i) {
    const std::string& definition = definitions.at(types[i]);
    schema += (i == 0 ? "" : kSeparator + "MSG: " + types[i] + "\n") + definition;
    for (const std::string& part : list_parts(definition))
      if (std::find(types.begin(), types.end(), part) == types.end()) types.push_back(part);
  }
  return schema;
}

std::string find_type_hash(const std::string& type) {
  // Made by idl/ros/type_hash.py; the same in ROS 2 Iron, Jazzy and Kilted.
  static const std::map<std::string, std::string> hashes = {
      {"geometry_msgs/msg/PoseStamped",
       "RIHS01_10f3786d7d40fd2b54367835614bff85d4ad3b5dab62bf8bca0cc232d73b4cd8"},
      {"nav_msgs/msg/Odometry",
       "RIHS01_3cc97dc7fb7502f8714462c526d369e35b603cfc34d946e3f2eda2766dfec6e0"},
      {"rosgraph_msgs/msg/Clock",
       "RIHS01_692f7a66e93a3c83e71765d033b60349ba68023a8c689a79e48078bcb5c58564"},
      {"tf2_msgs/msg/TFMessage",
       "RIHS01_e369d0f05a23ae52508854b66f6aa0437f3449d652e8cbf22d5abe85d020f087"},
      {"visualization_msgs/msg/MarkerArray",
       "RIHS01_86cb8800b6fb05b5eff1abd7a56f62a5641d3ae9a1c29e78e67e704f1d067dcf"}};
  return hashes.at(type);
}

}  // namespace sls::ros
