#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "recorder/recording_reader.hpp"
#include "recorder/sinks/growing_file.hpp"

namespace sls::record {

/// Makes `folder` ready for a recording: creates it, or uses an empty one. A folder that is not
/// empty is refused. With `force`, an earlier recording in it is removed, with its segments and
/// further runs; a folder with other files is still refused.
/// @throws config::ConfigError naming the folder and the cause.
void prepare_recording_folder(const std::filesystem::path& folder, bool force);

/// A prepared folder. When the object is destroyed before a recording has begun, because the disk
/// is full or no run came, files without rows are removed, and the folders that it made.
class RecordingFolder {
 public:
  /// @throws config::ConfigError as prepare_recording_folder.
  RecordingFolder(const std::filesystem::path& folder, bool force);
  ~RecordingFolder();
  RecordingFolder(const RecordingFolder&) = delete;
  RecordingFolder& operator=(const RecordingFolder&) = delete;

 private:
  const std::filesystem::path folder_;
  std::vector<std::filesystem::path> made_;  // innermost first
};

/// The recording of a killed recorder in `folder`, to be continued. If there is none yet, makes the
/// folder ready for a new one and returns nothing.
/// @throws config::ConfigError naming the folder if its recording is complete, or if the folder
///   cannot be used.
std::optional<OpenedRecording> find_unfinished_recording(const std::filesystem::path& folder);

/// The place of a recording, or of the part that follows the segments `earlier`.
struct Segment {
  std::filesystem::path folder;
  int number = 1;
  std::uint64_t first_step = 0;
  std::optional<OpenedRecording> earlier;
  WriteCall write = system_write();
};

/// A new segment after `earlier`, in its own folder.
/// @throws DamagedError if `earlier` cannot be read.
Segment make_next_segment(const OpenedRecording& earlier);

/// "run-0123456789abcdef": the subfolder of a further run.
std::string name_run(std::uint64_t run_id);

}  // namespace sls::record
