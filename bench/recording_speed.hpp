/// How fast `record::Recording` writes a run that it is fed in this process, and how fast its
/// numbers can be written at all.
#pragma once

#include <cstdint>
#include <filesystem>
#include <nlohmann/json_fwd.hpp>

#include "common/config/scenario.hpp"

namespace sls::bench {

/// Records `steps` steps of `vehicles` vehicles into new folders in `folder`, which are removed
/// again: once with Recording, once with nothing but std::to_chars and fwrite. Returns `rows` (of
/// state.csv, command.csv, reference.csv and flight.csv together), `bytes` of those files, and the
/// seconds `recording_s` (until the last row is with the operating system), `finish_s` (the hashes
/// and the manifest afterwards) and `plain_s`; of a scenario that asks for it also `mcap_bytes`.
/// @throws app::RunError if the recording is not complete, or if the plain files differ from it.
nlohmann::json measure_recording(const config::Scenario& scenario, std::uint32_t vehicles,
                                 std::size_t steps, const std::filesystem::path& folder);

}  // namespace sls::bench
