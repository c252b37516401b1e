#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

#include "recorder/recording_reader.hpp"

namespace sls::record {

/// Makes `folder` ready for a recording: creates it, or takes an empty one. One that is not empty
/// is refused; with `force`, the files of an earlier recording in it are removed, those of its
/// segments and further runs included, and anything else in it is still refused.
/// @throws config::ConfigError naming the folder and the cause.
void prepare_recording_folder(const std::filesystem::path& folder, bool force);

/// The recording in `folder` that a killed recorder has left, to be continued; nothing if there
/// is none yet, and the folder is ready for a new one.
/// @throws config::ConfigError naming the folder if its recording is complete, or it is not fit.
std::optional<RecordedFlight> find_unfinished_recording(const std::filesystem::path& folder);

/// Where a recording is written: all of it, or what follows `earlier` segments.
struct Segment {
  std::filesystem::path folder;
  int number = 1;
  std::uint64_t first_step = 0;
  std::optional<RecordedFlight> earlier;
};

/// A folder of its own for what follows `earlier`.
/// @throws DamagedError if that cannot be read.
Segment make_next_segment(const RecordedFlight& earlier);

/// "run-0123456789abcdef": the subfolder of a further run.
std::string name_run(std::uint64_t run_id);

}  // namespace sls::record
