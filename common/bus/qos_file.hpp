#pragma once

#include <filesystem>

namespace sls::bus {

/// Checks a QoS file before Fast DDS, which reports neither lines nor unknown names, gets to see
/// it: readable, well-formed, and every profile of topics.hpp defined once with the right element.
/// @throws config::ConfigError `FILE:LINE: …`.
void check_qos_file(const std::filesystem::path& file);

}  // namespace sls::bus
