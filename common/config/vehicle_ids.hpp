/// Vehicles of a fleet as the command line names them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "common/config/config_error.hpp"

namespace sls::config {

/// The ids that `--vehicles` names: `all`, or ids and ranges of them such as `0-9,20`. Sorted, each
/// once.
/// @throws ConfigError `--vehicles: expected …, got …` for anything else, a range that runs
/// backwards, and a vehicle beyond the fleet.
std::vector<std::uint32_t> parse_vehicle_ids(const std::string& text, std::size_t fleet_size);

/// `ids` (sorted, each once) in the same form: `0-9,20`.
std::string to_vehicle_ranges(const std::vector<std::uint32_t>& ids);

}  // namespace sls::config
