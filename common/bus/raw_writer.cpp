#include "common/bus/raw_writer.hpp"

#include <algorithm>

#include "fastdds_types.hpp"

namespace sls::bus {
namespace {

using Bytes = std::vector<std::uint8_t>;

/// A type whose samples are serialised already.
class RawType : public WrittenType {
 public:
  explicit RawType(const std::string& name) : WrittenType(name, RawWriter::kMostBytes) {}

 protected:
  bool write(const void* data, rtps::SerializedPayload_t& payload) const override {
    const Bytes& cdr = *static_cast<const Bytes*>(data);
    if (cdr.size() > payload.max_size) return false;
    std::copy(cdr.begin(), cdr.end(), payload.data);
    payload.length = static_cast<std::uint32_t>(cdr.size());
    payload.encapsulation = CDR_LE;
    return true;
  }
  std::uint32_t size(const void* data) const override {
    return static_cast<std::uint32_t>(static_cast<const Bytes*>(data)->size());
  }
};

void* make_raw_type(const std::string& name) {
  return static_cast<dds::TopicDataType*>(new RawType(name));
}

}  // namespace

RawWriter::RawWriter(Node& node, const RawTopic& topic, const char* profile)
    : topic_(topic.name),
      writer_(node, topic.name.c_str(), profile, make_raw_type(topic.type), topic.user_data) {}

void RawWriter::write(const std::vector<std::uint8_t>& cdr) {
  if (cdr.size() > kMostBytes)
    throw BusError(topic_ + ": expected at most " + std::to_string(kMostBytes) + " bytes, got " +
                   std::to_string(cdr.size()));
  if (!writer_.write(&cdr))
    throw BusError(topic_ + ": write refused: a reliable reader has not acknowledged for too long");
}

}  // namespace sls::bus
