#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "common/bus/topics.hpp"
#include "recorder/sinks/record_sink.hpp"
#include "recorder/stream.hpp"

namespace sls::record {

/// Consecutive steps of one topic that are not in the recording. For sls/status, from and to are
/// values of sample_index.
struct MissingSteps {
  std::uint32_t vehicle_id = 0;
  std::string topic;
  std::uint64_t from = 0;
  std::uint64_t to = 0;  ///< inclusive
};

/// The start of a stage whose first recorded step is a later one.
struct StageStart {
  std::uint32_t vehicle_id = 0;
  std::uint32_t stage = 0;
  std::uint64_t step = 0;

  bool operator==(const StageStart& other) const {
    return vehicle_id == other.vehicle_id && stage == other.stage && step == other.step;
  }
};

/// The gaps of a recording. Only the first ones are listed: a bad link can cause new ones for days.
struct MissingSamples {
  static constexpr std::size_t kMaxListed = 1000;

  std::vector<MissingSteps> listed;
  std::uint64_t further_gaps = 0;     ///< not listed
  std::uint64_t further_samples = 0;  ///< missing in these

  bool empty() const { return listed.empty(); }
};

/// "3 samples missing, first sls/reference step 123 of vehicle 0".
std::string describe(const MissingSamples& missing);

/// Contents of a recording and its completeness. In a segment after the first, `complete`,
/// `missing`, `stage_starts` and `certificate` cover all segments up to this one, the other fields
/// only this segment.
struct Manifest {
  Parameters parameters;
  std::string scenario_name;
  std::string outcome;  ///< recording, finished, failed, reset, interrupted, lost
  std::string reason;
  std::string timing;  ///< the last timing label of the server
  std::string certificate;
  int segment = 1;
  std::uint64_t first_step = 0;  ///< where the segment continues the earlier ones
  std::uint64_t last_step = 0;
  std::vector<RecordedFile> files;
  MissingSamples missing;
  std::vector<StageStart> stage_starts;
  std::uint64_t unanswered_steps = 0;  ///< flown with a held answer or the fail-safe force
  std::uint64_t refused_samples = 0;   ///< lost because the recorder's queue was full
  DroppedEntries dropped;
  std::map<std::string, std::string> libraries;  ///< SHA-256 of controllers' libraries, by name
  std::map<std::string, std::string> format_versions;  ///< of libraries of the sinks: "zstd"
  bool complete = false;  ///< the mission finished and nothing is missing
};

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
