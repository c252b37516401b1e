#pragma once

#include <filesystem>
#include <string>

namespace sls::bus {

/// The text of a QoS file for Fast DDS, completed for this process:
/// - `${NAME}` in a text is the environment variable of that name, `${NAME:-text}` has a default;
///   SLS_IDENTITY is `identity` unless it is set;
/// - a `<locator>` whose `<address>` lists several hosts, divided by commas, becomes one per host,
///   and host names become IPv4 addresses;
/// - a missing profile of a writer or reader is taken from endpoints.xml beside
///   `default_qos_file()`;
/// - keys that have other names in other versions of Fast DDS get the names of this one.
/// Checks that the file is readable and well-formed, and that every profile of topics.hpp is
/// defined once with the right element, because Fast DDS reports neither lines nor unknown names.
/// @throws config::ConfigError `FILE:LINE: …`.
std::string read_qos_file(const std::filesystem::path& file, const std::string& identity);

/// The error line about `file`, which Fast DDS refuses with the message `cause`: `FILE:LINE: <KEY>:
/// …` if that names a key, else `FILE: …`. A key may belong to another version of Fast DDS.
std::string describe_refusal(const std::filesystem::path& file, const std::string& cause);

/// SLS_IDENTITY if it is set, else `role`: selects the keys for a secured domain.
std::string find_identity(const std::string& role);

/// The QoS file used without `--qos`: qos/default.xml of the folder SLS_CONFIG (environment), else
/// of config/ of this checkout or installation, else of config/ of the source tree of the build.
std::filesystem::path default_qos_file();

}  // namespace sls::bus
