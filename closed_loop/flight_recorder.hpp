/// A flight in one process with the same recording as a flight of the three programs.
#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "closed_loop/flight.hpp"
#include "common/bus/topics.hpp"
#include "common/config/scenario.hpp"
#include "common/model/step_record.hpp"
#include "recorder/recording.hpp"
#include "sim_server/core/report/status_series.hpp"

namespace sls::closed_loop {

/// Writes the steps of a flight as a recording, as server, client and recorder would.
/// Every member @throws std::system_error with the name of the file if it cannot be written.
class FlightRecorder {
 public:
  /// Opens the files in `folder`, which must be new or empty; with `force`, an old recording in it
  /// is replaced. `parameters` are those that the flight's server would publish.
  /// @throws config::ConfigError for the folder.
  FlightRecorder(const std::filesystem::path& folder, bool force, const Parameters& parameters,
                 const config::Sync& sync, const std::string& controller_name);

  /// Notes the shared library of the law of `scenario`, if it has one that is loaded.
  void note_law_library(const config::Scenario& scenario);

  /// Adds one step of all vehicles, in the order of the parameters.
  void add(const std::vector<model::StepRecord>& steps);

  /// Adds remarks, dated at the last step that was added.
  void announce(const std::vector<std::string>& remarks);

  /// Ends the recording after the end of the flight; `failure` is empty if the missions were
  /// finished. True if the recording is complete.
  bool finish(const std::string& failure);
  /// Ends the recording of an interrupted flight.
  void interrupt(const std::string& reason);

  std::uint64_t last_step() const { return step_; }

 private:
  using Clock = std::chrono::steady_clock;

  void add_status(RunPhase phase, const std::string& reason);

  const std::string controller_name_;
  const record::RecordingFolder folder_;
  record::Recording recording_;
  sim::StatusSeries status_;
  std::uint64_t step_ = 0;
};

/// Result of a flight.
struct FlightEnd {
  std::uint64_t last_step = 0;
  std::string failure;       ///< why it failed; empty if every mission was finished
  bool is_complete = false;  ///< the recording
};

/// Flies all vehicles of `scenario` in lockstep and records them in `folder`, which must be new or
/// empty; with `force`, an old recording in it is replaced. The files hold the same data, with the
/// same certificate, as those of the three programs.
/// @throws config::ConfigError as Flight does, before the folder is touched, or for the folder.
/// @throws std::system_error with the name of the file if it cannot be written.
FlightEnd fly_recorded(const config::Scenario& scenario, const FlightOptions& options,
                       const std::filesystem::path& folder, bool force);

}  // namespace sls::closed_loop
