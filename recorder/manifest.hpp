#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "common/bus/topics.hpp"
#include "recorder/core/recording_core.hpp"
#include "recorder/sinks/record_sink.hpp"

namespace sls::record {

/// The start of a stage whose first recorded step is a later one.
struct StageStart {
  std::uint32_t vehicle_id = 0;
  std::uint32_t stage = 0;
  std::uint64_t step = 0;

  bool operator==(const StageStart& other) const {
    return vehicle_id == other.vehicle_id && stage == other.stage && step == other.step;
  }
};

/// Contents of a recording and its completeness. In a segment after the first, `complete`,
/// `missing`, `stage_starts` and `certificate` cover all segments up to this one, the other fields
/// only this segment.
struct Manifest : Claims {
  Parameters parameters;
  std::string scenario_name;
  std::string certificate;
  int segment = 1;
  std::uint64_t first_step = 0;  ///< where the segment continues the earlier ones
  std::vector<RecordedFile> files;
  std::vector<StageStart> stage_starts;
  std::map<std::string, std::string> format_versions;  ///< of libraries of the sinks: "zstd"
};

/// Synchronises a file or folder, which must survive a power cut. @throws std::system_error naming
/// it.
void sync_to_disk(const std::filesystem::path& path);

/// Writes `folder`/manifest.json and replaces an earlier one atomically: a reader finds the old or
/// the new one, never a part of it. The files that it lists are on the disk before it.
/// @throws std::system_error naming the file.
void write_manifest(const std::filesystem::path& folder, const Manifest& manifest);

/// A manifest that was read from a file.
struct ManifestFile {
  struct File {
    std::optional<std::uint64_t> rows;
    std::string sha256;
  };
  struct Signal {
    std::string name, unit;
  };
  bool complete = false;
  std::string outcome, reason, run_id, scenario_sha256, mode;
  std::string contract_sha256;  ///< empty in recordings of earlier versions
  double period_s = 0;
  std::vector<std::uint32_t> vehicle_ids;
  std::uint64_t first_step = 0;
  std::string certificate;  ///< empty while recording
  std::map<std::string, File> files;
  MissingSamples missing;
  std::vector<StageStart> stage_starts;
  std::vector<Signal> signals;
};

/// Reads `folder`/manifest.json.
/// @throws config::ConfigError naming the file if it cannot be read or is no manifest.
ManifestFile read_manifest(const std::filesystem::path& folder);

}  // namespace sls::record
