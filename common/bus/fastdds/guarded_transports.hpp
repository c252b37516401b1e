/// The transports of our participants, each on top of one of Fast DDS:
/// - UDP refuses harmful datagrams (datagram_guard.hpp), and sends small ones where asked.
/// - Shared memory has ports of its own, which no other build of Fast DDS opens (host_id.hpp).
#pragma once

#include <cstdint>
#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantListener.hpp>

#include "common/bus/fastdds/transports.hpp"

namespace sls::bus {

/// Creates a participant with them in the place of the transports of `qos`; null if Fast DDS
/// creates none. UDP sends datagrams of at most `most_sent` bytes, unless that is 0. Larger samples
/// are sent in fragments, which are repaired one by one. Without the limit, repairs are packed into
/// datagrams that IP cuts into 45 packets; a link that loses a fifth of the packets delivers no
/// such datagram (README.md, trap 27). Incoming datagrams may have any size; `maxMessageSize` in
/// XML would silently cut them, too.
///
/// Upstream: none reported. The limit can go when XML can limit outgoing datagrams only.
dds::DomainParticipant* create_participant(int domain, dds::DomainParticipantQos qos,
                                           dds::DomainParticipantListener* listener,
                                           std::uint32_t most_sent = 0);

/// The port of a participant in shared memory: `port` in the lower half, the build above.
std::uint32_t make_memory_port(std::uint32_t port);

}  // namespace sls::bus
