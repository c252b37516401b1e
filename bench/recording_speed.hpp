/// Measures how fast `record::Recording` writes a run in this process, and how fast the same
/// numbers can be written without it.
#pragma once

#include <cstdint>
#include <filesystem>
#include <nlohmann/json_fwd.hpp>

#include "common/config/scenario.hpp"

namespace sls::bench {

/// Records `steps` steps of `vehicles` vehicles twice: with Recording, and with std::to_chars and
/// fwrite only. The files go into new folders in `folder`, which are removed at the end. Returns
/// `rows` (of state.csv, command.csv, reference.csv and flight.csv together), `bytes` of those
/// files, and the seconds `recording_s` (until the last row is with the operating system),
/// `finish_s` (the hashes and the manifest afterwards) and `plain_s`. If the scenario records MCAP,
/// also `mcap_bytes`.
/// @throws app::RunError if the recording is not complete, or if the plain files differ from it.
nlohmann::json measure_recording(const config::Scenario& scenario, std::uint32_t vehicles,
                                 std::size_t steps, const std::filesystem::path& folder);

}  // namespace sls::bench
