/// The participant's QoS as a QoS file gives it. Internal to the doctor: it shows Fast DDS.
#pragma once

#include <fastdds/dds/domain/qos/DomainParticipantQos.hpp>

#include <filesystem>
#include <string>

#include "tools/doctor/probe.hpp"

namespace sls::doctor {

/// @throws config::ConfigError as Node does.
eprosima::fastdds::dds::DomainParticipantQos load_participant_qos(
    const std::filesystem::path& qos_file, const std::string& identity);

bool is_secured(const eprosima::fastdds::dds::DomainParticipantQos& qos);
Ports find_ports(const eprosima::fastdds::dds::DomainParticipantQos& qos, int domain);
/// Discovers by multicast because nothing else is asked for.
bool uses_default_multicast(const eprosima::fastdds::dds::DomainParticipantQos& qos);

}  // namespace sls::doctor
