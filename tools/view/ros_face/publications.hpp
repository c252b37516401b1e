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

/// Name of a ROS 2 type in DDS: "tf2_msgs/msg/TFMessage" → "tf2_msgs::msg::dds_::TFMessage_".
std::string mangle_type(const std::string& type);

/// DDS topic, type and USER_DATA of a channel, as ROS 2 readers expect them.
bus::RawTopic make_ros_topic(const ros::Channel& channel);

class Publications {
 public:
  /// Makes the writers that every run has, and writes the messages that are sent only once.
  explicit Publications(bus::Node& node);

  /// Begins a run: empties the trails of the mirrors, makes writers for its vehicles and removes
  /// the writers of other vehicles. @throws bus::BusError
  void begin(const std::vector<std::uint32_t>& vehicle_ids,
             std::optional<scene::LoadScene> scene = {});

  /// True if any topic of the run has a reader.
  bool has_readers() const;

  /// Writes the messages of `sample` whose topics have a reader. @throws bus::BusError
  void publish(const ros::VehicleSample& sample);

 private:
  std::unique_ptr<bus::RawWriter> take_or_make_writer(const ros::Channel& channel);

  bus::Node& node_;
  std::map<std::string, std::unique_ptr<bus::RawWriter>> writers_;  // by ROS topic
  std::optional<ros::Mirrors> mirrors_;
  std::vector<bus::RawWriter*> channels_;  // in the order of `mirrors_`
};

}  // namespace sls::view
