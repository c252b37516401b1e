/// Type supports of Fast DDS 3; version2/ has the same for Fast DDS 2.
#pragma once

#include <fastdds/dds/topic/TopicDataType.hpp>

#include <cstdint>
#include <string>

#include "fastdds_api.hpp"

namespace sls::bus {

/// Largest size of a sample in bytes, with the encapsulation header.
inline std::uint32_t max_size_of(const dds::TopicDataType& type) {
  return type.max_serialized_type_size;
}

inline std::string name_of(const dds::TopicDataType& type) { return type.get_name(); }

/// Serialises a sample into `payload`, which grows to its size.
inline bool serialize(dds::TopicDataType& type, const void* sample,
                      rtps::SerializedPayload_t& payload) {
  payload.reserve(type.calculate_serialized_size(sample, dds::XCDR_DATA_REPRESENTATION));
  return type.serialize(sample, payload, dds::XCDR_DATA_REPRESENTATION);
}

inline bool deserialize(dds::TopicDataType& type, rtps::SerializedPayload_t& payload,
                        void* sample) {
  return type.deserialize(payload, sample);
}

/// A generated type support whose samples `read` decodes and `write` encodes.
template <class Generated>
class CodedType : public Generated {
 public:
  /// Every type of ours has a largest size. The generator treats a sequence of structs with strings
  /// as unbounded.
  bool is_bounded() const final { return true; }
  bool serialize(const void* const data, rtps::SerializedPayload_t& payload,
                 dds::DataRepresentationId_t representation) final {
    return write(data, payload) || Generated::serialize(data, payload, representation);
  }
  std::uint32_t calculate_serialized_size(const void* const data,
                                          dds::DataRepresentationId_t representation) final {
    const std::uint32_t size = find_size(data);
    return size != 0 ? size : Generated::calculate_serialized_size(data, representation);
  }
  bool deserialize(rtps::SerializedPayload_t& payload, void* data) final {
    return read(payload, data);
  }
  void register_type_object_representation() final {}  // the generated one logs a warning

 protected:
  /// Size of a sample in bytes, with the encapsulation header; 0: as generated.
  virtual std::uint32_t find_size(const void* data) const = 0;
  /// False: as generated.
  virtual bool write(const void* data, rtps::SerializedPayload_t& payload) const = 0;
  virtual bool read(rtps::SerializedPayload_t& payload, void* data) = 0;
};

/// A type without keys that nothing but `write` encodes. It has no reader.
class WrittenType : public dds::TopicDataType {
 public:
  WrittenType(const std::string& name, std::uint32_t max_size) {
    set_name(name);
    max_serialized_type_size = max_size;
    is_compute_key_provided = false;
  }
  bool serialize(const void* data, rtps::SerializedPayload_t& payload,
                 dds::DataRepresentationId_t) final {
    return write(data, payload);
  }
  std::uint32_t calculate_serialized_size(const void* data, dds::DataRepresentationId_t) final {
    return size(data);
  }
  bool deserialize(rtps::SerializedPayload_t&, void*) final { return false; }
  bool compute_key(rtps::SerializedPayload_t&, rtps::InstanceHandle_t&, bool) final {
    return false;
  }
  bool compute_key(const void*, rtps::InstanceHandle_t&, bool) final { return false; }
  void* create_data() final { return nullptr; }
  void delete_data(void*) final {}

 protected:
  virtual bool write(const void* data, rtps::SerializedPayload_t& payload) const = 0;
  virtual std::uint32_t size(const void* data) const = 0;
};

}  // namespace sls::bus
