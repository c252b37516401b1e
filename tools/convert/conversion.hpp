/// Writes a recording's rows into one MCAP file: the bytes that the recorder would have written.
#pragma once

#include <cstdint>
#include <filesystem>

#include "recorder/recording_reader.hpp"

namespace sls::convert {

/// Where the file goes where the user does not say.
std::filesystem::path make_default_output(const record::RecordedFlight& flight);

/// Converts all segments, joined, into `out`, which appears when it is whole. Returns the number of
/// messages.
/// @throws config::ConfigError if `out` exists and `force` does not hold, has no name *.mcap or is
///   a file that the manifest beside it lists; also for a manifest that cannot be used.
/// @throws record::DamagedError if the recording cannot be read.
/// @throws std::system_error naming the file when the disk refuses.
std::uint64_t write_mcap(const record::RecordedFlight& flight, const std::filesystem::path& out,
                         bool force);

}  // namespace sls::convert
