#pragma once

#include <fastdds/dds/domain/qos/DomainParticipantQos.hpp>
#include <fastdds/rtps/transport/ChainingTransport.hpp>
#include <fastdds/utils/IPLocator.hpp>

#include <functional>
#include <memory>
#include <string>
#include <utility>

#include "common/bus/fastdds/plain_announcements.hpp"

namespace sls::bus {

/// Is told an announcement and the address from which it came, on threads of the middleware, before
/// the middleware gets it.
using AnnouncementHandler =
    std::function<void(const PlainAnnouncement&, const std::string& address)>;

namespace detail {

namespace rtps = eprosima::fastdds::rtps;

class PlainAnnouncementsTransport : public rtps::ChainingTransport {
 public:
  PlainAnnouncementsTransport(const rtps::ChainingTransportDescriptor& descriptor,
                              AnnouncementHandler handle)
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
    const auto found = find_announcement(message, size);
    if (found && !found->is_leaving) handle_(*found, rtps::IPLocator::toIPv4string(remote));
    next->OnDataReceived(message, size, local, remote);
    if (found && !found->as_secure.empty())
      next->OnDataReceived(found->as_secure.data(),
                           static_cast<std::uint32_t>(found->as_secure.size()), local, remote);
  }

 private:
  const AnnouncementHandler handle_;
};

struct PlainAnnouncementsDescriptor : rtps::ChainingTransportDescriptor {
  PlainAnnouncementsDescriptor(std::shared_ptr<rtps::TransportDescriptorInterface> transport,
                               AnnouncementHandler handler)
      : ChainingTransportDescriptor(std::move(transport)), handle(std::move(handler)) {}
  rtps::TransportInterface* create_transport() const override {
    return new PlainAnnouncementsTransport(*this, handle);
  }
  const AnnouncementHandler handle;
};

}  // namespace detail

/// Lets a secured participant discover those of Cyclone DDS (plain_announcements.hpp): each of its
/// transports also passes on their announcements as the secure ones that they do not send. `handle`
/// is told the announcements of all participants, also our own.
inline void hear_announcements(eprosima::fastdds::dds::DomainParticipantQos& qos,
                               const AnnouncementHandler& handle) {
  for (auto& transport : qos.transport().user_transports)
    transport = std::make_shared<detail::PlainAnnouncementsDescriptor>(transport, handle);
}

}  // namespace sls::bus
