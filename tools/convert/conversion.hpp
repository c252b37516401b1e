/// Writes a recording's rows into one MCAP file: the bytes that the recorder would have written.
#pragma once

#include <cstdint>
#include <filesystem>

#include "recorder/recording_reader.hpp"

namespace sls::convert {

/// Path of the file if the user does not give one.
std::filesystem::path make_default_output(const record::OpenedRecording& flight);

/// Joins all segments and converts them into `out`. The file appears only when it is complete.
/// Returns the number of messages.
/// @throws config::ConfigError if `out` exists and `force` is false, if its name does not end in
///   .mcap, or if the manifest beside it lists it; also if a manifest cannot be used.
/// @throws record::DamagedError if the recording cannot be read.
/// @throws std::system_error naming the file if it cannot be written.
std::uint64_t write_mcap(const record::OpenedRecording& flight, const std::filesystem::path& out,
                         bool force);

}  // namespace sls::convert
