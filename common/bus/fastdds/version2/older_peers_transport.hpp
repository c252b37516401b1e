#pragma once

#include <fastdds/dds/domain/qos/DomainParticipantQos.hpp>

#include <functional>
#include <string>

#include "common/bus/fastdds/older_peers.hpp"

namespace sls::bus {

using OlderPeerHandler = std::function<void(const OlderAnnouncement&, const std::string& address)>;

/// Nothing to do: see version 3.
inline void hear_older_peers(eprosima::fastdds::dds::DomainParticipantQos&,
                             const OlderPeerHandler&) {}

}  // namespace sls::bus
