/// For Fast DDS 3; version2/ has the same for Fast DDS 2.
#pragma once

#include "tests/foreign/edit.hpp"

namespace sls::foreign {

/// A type as if compiled from another IDL file: with a field more or less, another name, or a key.
template <class Generated>
class OtherType : public Generated {
 public:
  explicit OtherType(const Edit& edit) : edit_(edit) {
    this->max_serialized_type_size += kMostAdded;
  }
  void set_keyed() { this->is_compute_key_provided = true; }
  void set_type_name(const std::string& name) { this->set_name(name); }

  bool serialize(const void* data, bus::rtps::SerializedPayload_t& payload,
                 bus::dds::DataRepresentationId_t representation) override {
    return Generated::serialize(data, payload, representation) && apply(edit_, payload);
  }
  std::uint32_t calculate_serialized_size(
      const void* data, bus::dds::DataRepresentationId_t representation) override {
    return Generated::calculate_serialized_size(data, representation) + kMostAdded;
  }
  bool compute_key(bus::rtps::SerializedPayload_t&, bus::rtps::InstanceHandle_t& handle,
                   bool) override {
    handle.value[0] = 1;
    return true;
  }
  bool compute_key(const void*, bus::rtps::InstanceHandle_t& handle, bool) override {
    handle.value[0] = 1;
    return true;
  }

 private:
  const Edit edit_;
};

}  // namespace sls::foreign
