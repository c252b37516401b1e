#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "common/bus/topics.hpp"

namespace sls::record {

/// Consecutive steps of one topic that are not in the recording.
struct MissingSteps {
  std::uint32_t vehicle_id = 0;
  std::string topic;
  std::uint64_t from = 0;
  std::uint64_t to = 0;  ///< inclusive
};

struct RecordedFile {
  std::filesystem::path path;
  std::uint64_t rows = 0;
  bool has_rows = true;  ///< a CSV file: `rows` without its header
};

/// What a recording is and whether it is whole.
struct Manifest {
  Parameters parameters;
  std::string scenario_name;
  std::string outcome;  ///< recording, finished, failed, interrupted, lost
  std::string reason;
  std::uint64_t last_step = 0;
  std::vector<RecordedFile> files;
  std::vector<MissingSteps> missing;
  std::uint64_t refused_samples = 0;  ///< lost because the recorder's queue was full
  bool complete = false;              ///< the mission finished and nothing is missing
};

/// Writes `folder`/manifest.json, replacing an earlier one at once: a reader sees the old or the
/// new one, never half of one.
/// @throws std::system_error naming the file.
void write_manifest(const std::filesystem::path& folder, const Manifest& manifest);

}  // namespace sls::record
