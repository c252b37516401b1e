/// Names and calls of Fast DDS 3 that differ in Fast DDS 2. version2/ has the same for that
/// one; CMake chooses the folder. Other files use these names and do not know the version.
#pragma once

#include <fastdds/config.hpp>
#include <fastdds/dds/domain/qos/DomainParticipantQos.hpp>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/topic/TypeSupport.hpp>
#include <fastdds/rtps/attributes/PropertyPolicy.hpp>
#include <fastdds/rtps/common/CacheChange.hpp>
#include <fastdds/rtps/common/Guid.hpp>
#include <fastdds/rtps/transport/UDPv4TransportDescriptor.hpp>
#include <fastdds/rtps/transport/shared_mem/SharedMemTransportDescriptor.hpp>
#include <fastdds/utils/IPLocator.hpp>

#include <fastcdr/cdr/fixed_size_string.hpp>

#include <vector>

#include "fastdds_files.hpp"

namespace sls::bus {

namespace dds = eprosima::fastdds::dds;
namespace rtps = eprosima::fastdds::rtps;

template <std::size_t kMost>
using FixedString = eprosima::fastcdr::fixed_string<kMost>;
using Duration = dds::Duration_t;
using Time = dds::Time_t;
inline const Duration kInfinite = dds::c_TimeInfinite;

inline constexpr const char* kMiddlewareVersion = FASTDDS_VERSION_STR;

/// Environment variable that names a file of profiles.
inline constexpr const char* kProfilesVariable = "FASTDDS_DEFAULT_PROFILES_FILE";

inline bool is_ok(dds::ReturnCode_t code) { return code == dds::RETCODE_OK; }

inline bool write_sample(dds::DataWriter& writer, const void* sample) {
  return is_ok(writer.write(sample));
}

inline bool write_sample(dds::DataWriter& writer, const void* sample, const Time& time) {
  return is_ok(writer.write_w_timestamp(sample, dds::HANDLE_NIL, time));
}

inline void delete_writer(dds::Publisher& publisher, dds::DataWriter* writer) {
  writer->set_listener(nullptr);
  publisher.delete_datawriter(writer);
}

/// Nothing to do: the types are generated without a TypeObject.
inline void leave_out_type_object(dds::TypeSupport&) {}

/// Names the algorithms of DDS Security as version 2 does, which refuses the names of the standard.
inline void use_common_algorithms(dds::DomainParticipantQos& qos) {
  for (const char* plugin :
       {"dds.sec.auth.builtin.PKI-DH.", "dds.sec.access.builtin.Access-Permissions."})
    qos.properties().properties().emplace_back(
        std::string(plugin) + "transmit_algorithms_as_legacy", "true");
}

/// Addresses of the discovery servers that a client of theirs asks.
inline std::vector<rtps::Locator_t> find_discovery_servers(const dds::DomainParticipantQos& qos) {
  const auto& servers = qos.wire_protocol().builtin.discovery_config.m_DiscoveryServers;
  return {servers.begin(), servers.end()};
}

}  // namespace sls::bus
