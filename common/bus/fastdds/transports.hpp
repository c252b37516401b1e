/// Questions about the transports of a participant.
#pragma once

#include <algorithm>
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

}  // namespace sls::bus
