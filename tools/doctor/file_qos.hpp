/// The QoS of a QoS file. Internal to the doctor, because it exposes Fast DDS.
#pragma once

#include <fastdds/dds/domain/qos/DomainParticipantQos.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>

#include <filesystem>
#include <string>
#include <vector>

#include "tools/doctor/endpoint.hpp"
#include "tools/doctor/probe.hpp"

namespace sls::doctor {

/// @throws config::ConfigError as Node does.
eprosima::fastdds::dds::DomainParticipantQos load_participant_qos(
    const std::filesystem::path& qos_file, const std::string& identity);

bool is_secured(const eprosima::fastdds::dds::DomainParticipantQos& qos);
Ports find_ports(const eprosima::fastdds::dds::DomainParticipantQos& qos, int domain);
/// True if discovery uses multicast because the QoS names no discovery server and no peers.
bool uses_default_multicast(const eprosima::fastdds::dds::DomainParticipantQos& qos);

/// The writers and readers that the programs make in lockstep from the loaded profiles of `file`.
std::vector<Endpoint> make_own_endpoints(eprosima::fastdds::dds::Publisher& publisher,
                                         eprosima::fastdds::dds::Subscriber& subscriber,
                                         const std::string& file);

}  // namespace sls::doctor
