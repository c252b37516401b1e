#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

#include "recorder/recording_reader.hpp"

namespace sls::record {

/// Makes `folder` ready for a recording: creates it, or uses an empty one. A folder that is not
/// empty is refused. With `force`, an earlier recording in it is removed, with its segments and
/// further runs; a folder with other files is still refused.
/// @throws config::ConfigError naming the folder and the cause.
void prepare_recording_folder(const std::filesystem::path& folder, bool force);

/// The recording of a killed recorder in `folder`, to be continued. If there is none yet, makes the
/// folder ready for a new one and returns nothing.
/// @throws config::ConfigError naming the folder if its recording is complete, or if the folder
///   cannot be used.
std::optional<RecordedFlight> find_unfinished_recording(const std::filesystem::path& folder);

/// The place of a recording, or of the part that follows the segments `earlier`.
struct Segment {
  std::filesystem::path folder;
  int number = 1;
  std::uint64_t first_step = 0;
  std::optional<RecordedFlight> earlier;
};

/// A new segment after `earlier`, in its own folder.
/// @throws DamagedError if `earlier` cannot be read.
Segment make_next_segment(const RecordedFlight& earlier);

/// "run-0123456789abcdef": the subfolder of a further run.
std::string name_run(std::uint64_t run_id);

}  // namespace sls::record
