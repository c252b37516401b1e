/// A transport on top of another one, through which it sends unchanged: the function of it whose
/// arguments differ between the versions. Fast DDS 3.
#pragma once

#include <fastdds/rtps/transport/ChainingTransport.hpp>
#include <fastdds/rtps/transport/NetworkBuffer.hpp>
#include <fastdds/rtps/transport/SenderResource.hpp>

#include <chrono>
#include <cstdint>
#include <vector>

#include "fastdds_api.hpp"

namespace sls::bus {

class SendingTransport : public rtps::ChainingTransport {
 public:
  using ChainingTransport::ChainingTransport;

  bool send(rtps::SenderResource* below, const std::vector<rtps::NetworkBuffer>& buffers,
            std::uint32_t bytes, eprosima::fastdds::rtps::LocatorsIterator* first,
            eprosima::fastdds::rtps::LocatorsIterator* last,
            const std::chrono::steady_clock::time_point& deadline) override {
    return below->send(buffers, bytes, first, last, deadline);
  }
};

}  // namespace sls::bus
