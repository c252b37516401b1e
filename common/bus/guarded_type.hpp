#pragma once

#include <slsPubSubTypes.h>

#include <exception>

namespace sls::bus {

/// A generated type support whose `deserialize` refuses whatever is malformed. The generated one
/// lets most of the exceptions of the serialisation library through, which end the process: one
/// sample of any stranger would do (README.md, trap 15).
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
