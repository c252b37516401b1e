/// The transports of a participant: questions, and the length of its shared-memory queue.
#pragma once

#include <algorithm>
#include <cstdint>
#include <fastdds/dds/core/policy/QosPolicies.hpp>
#include <memory>
#include <string>

#include "fastdds_api.hpp"

namespace sls::bus {

using TransportDescriptor = std::shared_ptr<rtps::TransportDescriptorInterface>;

inline bool is_shared_memory(const TransportDescriptor& descriptor) {
  return std::dynamic_pointer_cast<rtps::SharedMemTransportDescriptor>(descriptor) != nullptr;
}

/// True if no packet leaves this machine: shared memory, and UDP on loopback addresses alone.
inline bool is_local(const TransportDescriptor& descriptor) {
  if (is_shared_memory(descriptor)) return true;
  const auto udp = std::dynamic_pointer_cast<rtps::UDPv4TransportDescriptor>(descriptor);
  if (!udp || udp->interfaceWhiteList.empty()) return false;
  const auto& addresses = udp->interfaceWhiteList;
  return std::all_of(addresses.begin(), addresses.end(),
                     [](const std::string& address) { return address.compare(0, 4, "127.") == 0; });
}

/// The same for all transports of a participant. The built-in ones use every interface.
inline bool are_local(const dds::TransportConfigQos& transports) {
  const auto& own = transports.user_transports;
  return !transports.use_builtin_transports && !own.empty() &&
         std::all_of(own.begin(), own.end(), is_local);
}

/// Gives a participant a short queue for the messages that others send over shared memory. A sender
/// keeps each message until it has been taken, so the queue of a killed or stopped process fills
/// the sender's segment. The sender then frees the oldest messages one by one, and between the rest
/// it may find no room for a longer one: a server whose client had been killed could publish no
/// more batches (README.md, trap 41).
///
/// Upstream: none reported. To be deleted when `SharedMemManager::Segment::recover_buffers` frees
/// until the message fits.
inline void shorten_queue(dds::TransportConfigQos& transports) {
  constexpr std::uint32_t kMessages = 128;
  for (TransportDescriptor& transport : transports.user_transports) {
    const auto memory = std::dynamic_pointer_cast<rtps::SharedMemTransportDescriptor>(transport);
    if (!memory || memory->port_queue_capacity() <= kMessages) continue;
    const auto own = std::make_shared<rtps::SharedMemTransportDescriptor>(*memory);
    own->port_queue_capacity(kMessages);
    transport = own;  // the profile keeps the other one
  }
}

}  // namespace sls::bus
