#pragma once

#include <slsPubSubTypes.h>

#include <exception>

namespace sls::bus {

/// A generated type support whose `deserialize` refuses malformed samples. The generated one lets
/// most exceptions of the serialisation library through, which end the process: one sample of any
/// stranger would do (README.md, traps 15 and 23).
///
/// Upstream: Fast-CDR #144; Fast DDS 2.11 catches more, but not std::bad_alloc. To be deleted when
/// the generated function catches every exception and makes no more elements than a sample's length
/// allows; guarded_type_test.cpp then passes without.
template <class Generated>
class GuardedType : public Generated {
 public:
  bool deserialize(eprosima::fastrtps::rtps::SerializedPayload_t* payload, void* data) override {
    // What is longer than any sample may claim elements without end, which are made before they are
    // read.
    if (payload->length > this->m_typeSize) return false;
    try {
      return Generated::deserialize(payload, data);
    } catch (const std::exception&) {
      return false;
    }
  }
};

}  // namespace sls::bus
