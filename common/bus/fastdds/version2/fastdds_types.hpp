/// Type supports of Fast DDS 2; version3/ has the same for Fast DDS 3.
#pragma once

#include <fastdds/dds/topic/TopicDataType.hpp>

#include <cstdint>
#include <functional>
#include <string>

#include "fastdds_api.hpp"

namespace sls::bus {

/// Largest size of a sample in bytes, with the encapsulation header.
inline std::uint32_t max_size_of(const dds::TopicDataType& type) { return type.m_typeSize; }

inline std::string name_of(const dds::TopicDataType& type) { return type.getName(); }

/// Serialises a sample into `payload`, which grows to its size.
inline bool serialize(dds::TopicDataType& type, const void* sample,
                      rtps::SerializedPayload_t& payload) {
  void* const data = const_cast<void*>(sample);  // it is only read
  payload.reserve(type.getSerializedSizeProvider(data)());
  return type.serialize(data, &payload);
}

inline bool deserialize(dds::TopicDataType& type, rtps::SerializedPayload_t& payload,
                        void* sample) {
  return type.deserialize(&payload, sample);
}

/// A generated type support whose samples `read` decodes and `write` encodes.
template <class Generated>
class CodedType : public Generated {
 public:
  /// Every type of ours has a largest size. The generator treats a sequence of structs with strings
  /// as unbounded.
  bool is_bounded() const final { return true; }
  bool serialize(void* data, rtps::SerializedPayload_t* payload) final {
    return write(data, *payload) || Generated::serialize(data, payload);
  }
  std::function<std::uint32_t()> getSerializedSizeProvider(void* data) final {
    const std::uint32_t size = find_size(data);
    if (size == 0) return Generated::getSerializedSizeProvider(data);
    return [size] { return size; };
  }
  bool deserialize(rtps::SerializedPayload_t* payload, void* data) final {
    return read(*payload, data);
  }

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
    setName(name.c_str());
    m_typeSize = max_size;
    m_isGetKeyDefined = false;
  }
  bool serialize(void* data, rtps::SerializedPayload_t* payload) final {
    return write(data, *payload);
  }
  std::function<std::uint32_t()> getSerializedSizeProvider(void* data) final {
    return [this, data] { return size(data); };
  }
  bool deserialize(rtps::SerializedPayload_t*, void*) final { return false; }
  bool getKey(void*, rtps::InstanceHandle_t*, bool) final { return false; }
  void* createData() final { return nullptr; }
  void deleteData(void*) final {}

 protected:
  virtual bool write(const void* data, rtps::SerializedPayload_t& payload) const = 0;
  virtual std::uint32_t size(const void* data) const = 0;
};

}  // namespace sls::bus
