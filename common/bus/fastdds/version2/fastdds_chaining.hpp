/// A transport on top of another one, through which it sends unchanged: the function of it whose
/// arguments differ between the versions. Fast DDS 2.
#pragma once

#include <fastdds/rtps/network/SenderResource.h>
#include <fastdds/rtps/transport/ChainingTransport.h>

#include <chrono>
#include <cstdint>

#include "fastdds_api.hpp"

namespace sls::bus {

class SendingTransport : public rtps::ChainingTransport {
 public:
  using ChainingTransport::ChainingTransport;

  bool send(rtps::SenderResource* below, const rtps::octet* buffer, std::uint32_t bytes,
            eprosima::fastdds::rtps::LocatorsIterator* first,
            eprosima::fastdds::rtps::LocatorsIterator* last,
            const std::chrono::steady_clock::time_point& deadline) override {
    return below->send(buffer, bytes, first, last, deadline);
  }
};

}  // namespace sls::bus
