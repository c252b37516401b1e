/// Names and calls of Fast DDS 2 (2.9 to 2.14) that differ in Fast DDS 3. version3/ has the
/// same for that one; CMake chooses the folder. Other files use these names and do not know the
/// version.
#pragma once

#include <fastdds/rtps/attributes/PropertyPolicy.h>
#include <fastdds/rtps/common/CacheChange.h>
#include <fastdds/rtps/common/Guid.h>
#include <fastdds/rtps/transport/UDPv4TransportDescriptor.h>
#include <fastdds/rtps/transport/shared_mem/SharedMemTransportDescriptor.h>
#include <fastrtps/config.h>
#include <fastrtps/utils/IPLocator.h>
#include <fastdds/dds/domain/qos/DomainParticipantQos.hpp>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/topic/TypeSupport.hpp>
#include <fastrtps/utils/fixed_size_string.hpp>

#include <cstddef>
#include <vector>

#include "fastdds_files.hpp"

namespace sls::bus {

namespace dds = eprosima::fastdds::dds;

namespace rtps {
using namespace eprosima::fastrtps::rtps;
using namespace eprosima::fastdds::rtps;
}  // namespace rtps

template <std::size_t kMost>
using FixedString = eprosima::fastrtps::fixed_string<kMost>;
using Duration = eprosima::fastrtps::Duration_t;
using Time = eprosima::fastrtps::Time_t;
inline const Duration kInfinite = eprosima::fastrtps::c_TimeInfinite;

inline constexpr const char* kMiddlewareVersion = FASTRTPS_VERSION_STR;

/// Environment variable that names a file of profiles.
inline constexpr const char* kProfilesVariable = "FASTRTPS_DEFAULT_PROFILES_FILE";

inline bool is_ok(const eprosima::fastrtps::types::ReturnCode_t& code) {
  return code == eprosima::fastrtps::types::ReturnCode_t::RETCODE_OK;
}

inline bool write_sample(dds::DataWriter& writer, const void* sample) {
  return writer.write(const_cast<void*>(sample));  // it is only read
}

inline bool write_sample(dds::DataWriter& writer, const void* sample, const Time& time) {
  return is_ok(writer.write_w_timestamp(const_cast<void*>(sample), dds::HANDLE_NIL, time));
}

/// Deletes a writer of `publisher` after its history: otherwise a heartbeat to a dead reader may
/// find a half-deleted history and loop for ever (README.md, trap 13).
inline void delete_writer(dds::Publisher& publisher, dds::DataWriter* writer) {
  writer->set_listener(nullptr);
  std::size_t removed = 0;
  writer->clear_history(&removed);
  publisher.delete_datawriter(writer);
}

/// Call it before the type is registered: a TypeObject on the wire crashes peers that do not know
/// the type (README.md, trap 1). Upstream: #3296.
inline void leave_out_type_object(dds::TypeSupport& type) {
  type->auto_fill_type_object(false);
  type->auto_fill_type_information(false);
}

/// Nothing to do: see version 3.
inline void use_common_algorithms(dds::DomainParticipantQos&) {}

/// Addresses of the discovery servers that a client of theirs asks.
inline std::vector<rtps::Locator_t> find_discovery_servers(const dds::DomainParticipantQos& qos) {
  std::vector<rtps::Locator_t> addresses;
  for (const auto& server : qos.wire_protocol().builtin.discovery_config.m_DiscoveryServers)
    for (const auto& address : server.metatrafficUnicastLocatorList) addresses.push_back(address);
  return addresses;
}

}  // namespace sls::bus
