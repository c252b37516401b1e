/// For Fast DDS 2; version3/ has the same for Fast DDS 3.
#pragma once

#include "tests/foreign/edit.hpp"

namespace sls::foreign {

/// A type as if compiled from another IDL file: with a field more or less, another name, or a key.
template <class Generated>
class OtherType : public Generated {
 public:
  explicit OtherType(const Edit& edit) : edit_(edit) {
    this->m_typeSize += kMostAdded;
    this->auto_fill_type_object(false);
    this->auto_fill_type_information(false);
  }
  void set_keyed() { this->m_isGetKeyDefined = true; }
  void set_type_name(const std::string& name) { this->setName(name.c_str()); }

  bool serialize(void* data, bus::rtps::SerializedPayload_t* payload) override {
    return Generated::serialize(data, payload) && apply(edit_, *payload);
  }
  std::function<std::uint32_t()> getSerializedSizeProvider(void* data) override {
    return [size = Generated::getSerializedSizeProvider(data)] { return size() + kMostAdded; };
  }
  bool getKey(void*, bus::rtps::InstanceHandle_t* handle, bool) override {
    handle->value[0] = 1;
    return true;
  }

 private:
  const Edit edit_;
};

}  // namespace sls::foreign
