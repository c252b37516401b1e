#include "tools/view/ros_face/publications.hpp"

#include <algorithm>

namespace sls::view {

std::string mangle_type(const std::string& type) {
  const std::size_t package_end = type.find('/');
  return type.substr(0, package_end) + "::msg::dds_::" + type.substr(type.rfind('/') + 1) + "_";
}

bus::RawTopic make_ros_topic(const ros::Channel& channel) {
  return {"rt" + channel.topic, mangle_type(channel.type), "typehash=" + channel.type_hash + ";"};
}

Publications::Publications(bus::Node& node) : node_(node) {
  begin({});
  mirrors_->emit_static([this](std::size_t channel, std::int64_t, const auto& cdr) {
    channels_[channel]->write(cdr);
  });
}

void Publications::begin(const std::vector<std::uint32_t>& vehicle_ids,
                         std::optional<scene::LoadScene> scene) {
  mirrors_.emplace(vehicle_ids, std::move(scene));
  channels_.clear();
  std::map<std::string, std::unique_ptr<bus::RawWriter>> writers;
  for (const ros::Channel& channel : mirrors_->channels()) {
    auto& writer = writers[channel.topic] = take_or_make_writer(channel);
    channels_.push_back(writer.get());
  }
  writers_ = std::move(writers);
}

std::unique_ptr<bus::RawWriter> Publications::take_or_make_writer(const ros::Channel& channel) {
  const auto known = writers_.find(channel.topic);
  if (known != writers_.end()) return std::move(known->second);
  // Both are reliable and transient-local, which suits readers of any reliability and durability.
  const char* profile = channel.is_latched ? bus::kLatchedWriterProfile : bus::kLoopWriterProfile;
  return std::make_unique<bus::RawWriter>(node_, make_ros_topic(channel), profile);
}

bool Publications::has_readers() const {
  return std::any_of(channels_.begin(), channels_.end(),
                     [](const bus::RawWriter* writer) { return !writer->matched().empty(); });
}

void Publications::publish(const ros::VehicleSample& sample) {
  mirrors_->emit(sample, [this](std::size_t channel, std::int64_t, const auto& cdr) {
    if (!channels_[channel]->matched().empty()) channels_[channel]->write(cdr);
  });
}

}  // namespace sls::view
