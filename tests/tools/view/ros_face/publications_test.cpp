#include "tools/view/ros_face/publications.hpp"

#include <gtest/gtest.h>

namespace sls::view {
namespace {

TEST(PublicationsTest, NameTopicsTypesAndHashesAsRos2Does) {
  ros::Channel channel;
  channel.topic = "/sls/vehicle_0/load/pose";
  channel.type = "geometry_msgs/msg/PoseStamped";
  channel.type_hash = "RIHS01_0123";
  const bus::RawTopic topic = make_ros_topic(channel);
  EXPECT_EQ(topic.name, "rt/sls/vehicle_0/load/pose");
  EXPECT_EQ(topic.type, "geometry_msgs::msg::dds_::PoseStamped_");
  EXPECT_EQ(topic.user_data, "typehash=RIHS01_0123;");
}

}  // namespace
}  // namespace sls::view
