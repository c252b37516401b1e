/// A transport on top of another one that sends through that one unchanged. Fast DDS 2.
#pragma once

#include <fastdds/rtps/network/SenderResource.h>
#include <fastdds/rtps/transport/ChainingTransport.h>

#include <chrono>
#include <cstdint>

#include "fastdds_api.hpp"

namespace sls::bus {

class ChainedTransport : public rtps::ChainingTransport {
 public:
  using ChainingTransport::ChainingTransport;

  rtps::TransportDescriptorInterface* get_configuration() override {
    return low_level_transport_->get_configuration();
  }

  /// One channel sends to all addresses. The transport below does not recognise its own channel
  /// inside ours: it opens another one for each address, which is closed again. Otherwise each
  /// message would go out as often. The transport needs each address all the same (statistics).
  bool OpenOutputChannel(rtps::SendResourceList& channels,
                         const rtps::Locator_t& address) override {
    rtps::SendResourceList others;
    if (is_open_) return low_level_transport_->OpenOutputChannel(others, address);
    is_open_ = ChainingTransport::OpenOutputChannel(channels, address);
    return is_open_;
  }

  bool send(rtps::SenderResource* below, const rtps::octet* buffer, std::uint32_t bytes,
            eprosima::fastdds::rtps::LocatorsIterator* first,
            eprosima::fastdds::rtps::LocatorsIterator* last,
            const std::chrono::steady_clock::time_point& deadline) override {
    return below->send(buffer, bytes, first, last, deadline);
  }

 private:
  bool is_open_ = false;
};

}  // namespace sls::bus
