#pragma once

#include <fastdds/dds/domain/qos/DomainParticipantQos.hpp>
#include <fastdds/rtps/transport/ChainingTransport.hpp>
#include <fastdds/utils/IPLocator.hpp>

#include <functional>
#include <memory>
#include <string>
#include <utility>

#include "common/bus/fastdds/older_peers.hpp"

namespace sls::bus {

/// Is told an announcement and the address from which it came, on threads of the middleware.
using OlderPeerHandler = std::function<void(const OlderAnnouncement&, const std::string& address)>;

namespace detail {

namespace rtps = eprosima::fastdds::rtps;

class OlderPeersTransport : public rtps::ChainingTransport {
 public:
  OlderPeersTransport(const rtps::ChainingTransportDescriptor& descriptor, OlderPeerHandler handle)
      : ChainingTransport(descriptor), handle_(std::move(handle)) {}

  rtps::TransportDescriptorInterface* get_configuration() override {
    return low_level_transport_->get_configuration();
  }

  bool send(rtps::SenderResource* sender, const std::vector<rtps::NetworkBuffer>& buffers,
            std::uint32_t bytes, rtps::LocatorsIterator* begin, rtps::LocatorsIterator* end,
            const std::chrono::steady_clock::time_point& timeout) override {
    return sender->send(buffers, bytes, begin, end, timeout);
  }

  void receive(rtps::TransportReceiverInterface* next, const rtps::octet* message,
               std::uint32_t size, const rtps::Locator_t& local,
               const rtps::Locator_t& remote) override {
    next->OnDataReceived(message, size, local, remote);
    const auto found = find_older_announcement(message, size);
    if (!found) return;
    handle_(*found, rtps::IPLocator::toIPv4string(remote));
    next->OnDataReceived(found->as_secure.data(),
                         static_cast<std::uint32_t>(found->as_secure.size()), local, remote);
  }

 private:
  const OlderPeerHandler handle_;
};

struct OlderPeersDescriptor : rtps::ChainingTransportDescriptor {
  OlderPeersDescriptor(std::shared_ptr<rtps::TransportDescriptorInterface> transport,
                       OlderPeerHandler handler)
      : ChainingTransportDescriptor(std::move(transport)), handle(std::move(handler)) {}
  rtps::TransportInterface* create_transport() const override {
    return new OlderPeersTransport(*this, handle);
  }
  const OlderPeerHandler handle;
};

}  // namespace detail

/// Lets a secured participant discover those of Fast DDS before 2.13 (older_peers.hpp): each of its
/// transports also passes on their announcements as the secure ones that they do not send. `handle`
/// is told each one.
inline void hear_older_peers(eprosima::fastdds::dds::DomainParticipantQos& qos,
                             const OlderPeerHandler& handle) {
  for (auto& transport : qos.transport().user_transports)
    transport = std::make_shared<detail::OlderPeersDescriptor>(transport, handle);
}

}  // namespace sls::bus
