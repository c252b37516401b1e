/// One recording on disk: takes the samples of one run and keeps the files. No network here; used
/// by one thread.
#pragma once

#include <chrono>
#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "common/bus/topics.hpp"
#include "common/config/scenario.hpp"
#include "recorder/csv_file.hpp"
#include "recorder/flight_log.hpp"
#include "recorder/manifest.hpp"
#include "recorder/step_join.hpp"

namespace sls::record {

class Recording {
 public:
  /// Opens the files in `folder` (see prepare_recording_folder) and writes a manifest that says
  /// "recording", not complete.
  /// @throws config::ConfigError if the scenario in `parameters` cannot be read.
  /// Every member @throws std::system_error naming the file when the disk refuses.
  Recording(const std::filesystem::path& folder, const Parameters& parameters);

  /// Samples of other runs and vehicles are ignored.
  void add(const VehicleState& state);
  void add(const ControlCommand& command);
  void add(const Reference& reference);
  void add(const SimStatus& status);

  /// Flushes the files if the last time is `record.flush_s` ago.
  void flush_if_due();

  /// True when the run has ended and every step of every vehicle is in.
  bool has_all() const;

  /// The last step of which, and of all before it, all vehicles' rows are in; −1: none.
  std::int64_t last_complete_step() const;

  /// Writes what is pending, flight.txt and the final manifest. `interruption` says why the
  /// recorder stops early; empty where it did not. True if the recording is complete.
  bool finish(const std::string& interruption, std::uint64_t refused_samples);

  /// Why it is not complete, in one line; after `finish`.
  std::string describe_gaps() const;

 private:
  void write(std::uint32_t vehicle_id, const StepRecord& record);
  void note_missing(std::uint32_t vehicle_id, const char* topic, std::uint64_t step);
  void note_missing_range(std::uint32_t vehicle_id, const char* topic, std::uint64_t from,
                          std::uint64_t to);
  StepJoin* find_vehicle(std::uint64_t run_id, std::uint32_t vehicle_id);
  bool has_ended() const;
  bool is_finished() const;
  void flush();
  std::string describe_missing() const;

  const std::filesystem::path folder_;
  const Parameters parameters_;
  const config::Scenario scenario_;
  CsvFile states_, commands_, references_, statuses_, flight_;
  FlightLog log_;
  std::map<std::uint32_t, StepJoin> vehicles_;
  std::vector<MissingSteps> missing_;
  SimStatus last_status_;
  std::string interruption_;           // from `finish` on
  std::uint64_t refused_samples_ = 0;  // likewise
  std::chrono::steady_clock::time_point flush_time_;
};

}  // namespace sls::record
