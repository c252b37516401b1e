#pragma once

#include <cstdint>
#include <memory>

#include "fastdds_api.hpp"

namespace sls::bus {

namespace detail {

struct SmallDatagrams : rtps::UDPv4TransportDescriptor {
  SmallDatagrams(const UDPv4TransportDescriptor& other, std::uint32_t bytes)
      : UDPv4TransportDescriptor(other), max_sent(bytes) {}
  std::uint32_t max_message_size() const override { return max_sent; }
  std::uint32_t max_sent;
};

}  // namespace detail

/// A transport like `transport` that, if it is UDP, sends datagrams of at most `bytes`. Larger
/// samples are sent in fragments, which are repaired one by one. Without the limit, repairs are
/// packed into datagrams that IP cuts into 45 packets; a link that loses a fifth of the packets
/// delivers no such datagram (README.md, trap 27). Incoming datagrams may have any size;
/// `maxMessageSize` in XML would silently cut them, too.
///
/// Upstream: none reported. To be deleted when XML can limit outgoing datagrams only.
inline std::shared_ptr<rtps::TransportDescriptorInterface> send_small_datagrams(
    const std::shared_ptr<rtps::TransportDescriptorInterface>& transport, std::uint32_t bytes) {
  const auto* udp = dynamic_cast<const rtps::UDPv4TransportDescriptor*>(transport.get());
  if (!udp) return transport;
  return std::make_shared<detail::SmallDatagrams>(*udp, bytes);
}

}  // namespace sls::bus
