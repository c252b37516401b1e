#pragma once

#include <filesystem>
#include <string>

namespace sls::bus {

/// Checks the files that the DDS Security properties in `profiles` (a QoS file as `read_qos_file`
/// completes it) name, because Fast DDS 2.9.1 only says "initialization error": readable; a
/// certificate that is valid now and of the identity authority; the key of it; governance and
/// permissions signed by the permissions authority; permissions for this certificate, valid now.
/// @returns whether there are any, which makes a participant a secured one.
/// @throws config::ConfigError `FILE: expected …, got …`.
bool check_security_files(const std::string& profiles);

/// True if a signed permissions document is of contract 1: it grants topics that contract 2 has
/// not, and not sls/record.
bool is_of_contract_1(const std::filesystem::path& permissions);

}  // namespace sls::bus
