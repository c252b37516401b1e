/// Settings of a QoS file that decide the path of data.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "tools/doctor/probe.hpp"

namespace sls::doctor {

/// From the profile of the participant.
struct Settings {
  Ports ports;
  bool uses_shared_memory = false;
  std::uint32_t segment_size = 0;              ///< of shared memory, bytes
  std::vector<std::string> only_addresses;     ///< of interfaces; none: all
  bool uses_multicast = false;                 ///< for discovery
  std::vector<std::string> discovery_servers;  ///< "10.0.0.1:11811"; empty: none is used
  bool is_secured = false;
  std::string expiry;  ///< SecurityFiles::expiry

  /// True if no data leave the machine.
  bool is_local() const;
};

/// @throws config::ConfigError as Node does.
Settings load_settings(const std::filesystem::path& qos_file, int domain,
                       const std::string& identity);

}  // namespace sls::doctor
