#pragma once

#include <filesystem>
#include <string>

namespace sls::bus {

/// A QoS file as Fast DDS is to see it, completed for this process:
/// - `${NAME}` in a text is the environment variable of that name, `${NAME:-text}` has a default;
///   SLS_IDENTITY is `identity` unless it is set;
/// - a `<locator>` whose `<address>` lists several hosts, divided by commas, becomes one per host,
///   and host names become IPv4 addresses;
/// - a profile of a writer or reader that the file leaves out is the one of endpoints.xml beside
///   `default_qos_file()`.
/// Checked before Fast DDS, which reports neither lines nor unknown names, gets to see it:
/// readable, well-formed, and every profile of topics.hpp defined once with the right element.
/// @throws config::ConfigError `FILE:LINE: …`.
std::string read_qos_file(const std::filesystem::path& file, const std::string& identity);

/// SLS_IDENTITY if it is set, else `role`: whose keys a secured domain sees.
std::string find_identity(const std::string& role);

/// The QoS file used without `--qos`: qos/default.xml of the folder SLS_CONFIG (environment), or of
/// config/ of this installation. A program outside an installation has none.
std::filesystem::path default_qos_file();

}  // namespace sls::bus
