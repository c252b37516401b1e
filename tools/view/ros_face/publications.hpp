/// The writers of rt/… topics.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/bus/raw_writer.hpp"
#include "common/ros/mirrors.hpp"

namespace sls::view {

/// "tf2_msgs/msg/TFMessage" → "tf2_msgs::msg::dds_::TFMessage_": how ROS 2 names types in DDS.
std::string mangle_type(const std::string& type);

/// Topic of DDS, type and USER_DATA of a channel, as ROS 2 readers look for them.
bus::RawTopic make_ros_topic(const ros::Channel& channel);

class Publications {
 public:
  /// Makes the writers that every run has, and writes what there is once.
  explicit Publications(bus::Node& node);

  /// A run begins: mirrors with empty trails, writers of its vehicles. Those of vehicles that it
  /// does not have end. @throws bus::BusError
  void begin(const std::vector<std::uint32_t>& vehicle_ids);

  /// True if somebody reads any topic of the run.
  bool has_readers() const;

  /// Writes the messages of `sample` that somebody reads. @throws bus::BusError
  void publish(const ros::VehicleSample& sample);

 private:
  std::unique_ptr<bus::RawWriter> take_or_make_writer(const ros::Channel& channel);

  bus::Node& node_;
  std::map<std::string, std::unique_ptr<bus::RawWriter>> writers_;  // by topic of ROS
  std::optional<ros::Mirrors> mirrors_;
  std::vector<bus::RawWriter*> channels_;  // of `mirrors_`
};

}  // namespace sls::view
