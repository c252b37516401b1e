/// One recording on disk: writes the files as its core decides. No network here; used by one
/// thread.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "common/app/awake_clock.hpp"
#include "common/bus/topics.hpp"
#include "common/config/scenario.hpp"
#include "recorder/certificate.hpp"
#include "recorder/core/recorder_core.hpp"
#include "recorder/core/recording_core.hpp"
#include "recorder/flight_log.hpp"
#include "recorder/manifest.hpp"
#include "recorder/recording_folder.hpp"
#include "recorder/sinks/record_sink.hpp"

namespace sls::record {

class Recording final : private RecordingOutputs {
 public:
  /// Opens the files in the segment's folder, which must be ready, reads the earlier segments and
  /// writes a manifest with the outcome "recording", not complete.
  /// @throws config::ConfigError if the scenario or the signals in `parameters` cannot be used, or
  ///   the scenario is not that of the earlier segments.
  /// @throws DamagedError if an earlier segment cannot be read.
  /// Every member @throws std::system_error with the name of the file if it cannot be written.
  Recording(const Segment& segment, const Parameters& parameters,
            sync::Time now = app::awake_clock().now());
  /// For a recording of one segment.
  Recording(const std::filesystem::path& folder, const Parameters& parameters);

  /// As RecordingCore's events of these names.
  void add(const model::StepRecord& record) { core_.on_step(record); }
  void add(const RecordBatch& batch, sync::Time now = {}) { core_.on_batch(batch, now); }
  void add(const SimStatus& status) { core_.on_status(status); }
  void note_library(const std::string& controller, const std::string& sha256) {
    core_.on_library(controller, sha256);
  }
  /// Flushes the files if the last flush is `record.flush_s` ago. After a time limit, a lost batch
  /// is no longer waited for.
  void flush_if_due(sync::Time now = app::awake_clock().now()) { core_.on_time(now); }

  /// True when the run has ended and its last batch has been handled.
  bool has_all() const { return core_.phase() == RecordingCore::Phase::kWhole; }
  bool is_reset() const { return core_.has_phase(RunPhase::PHASE_RESET); }
  const config::Scenario& scenario() const { return scenario_; }

  /// The last step up to which all steps of all vehicles have come or are known to be missing; −1:
  /// none. The last 64 of them may wait for late answers before they are written.
  std::int64_t last_complete_step() const { return core_.last_complete_step(); }

  /// Writes pending rows, flight.txt and the final manifest. If the recorder stops early,
  /// `interruption` is the reason and `outcome` the outcome in the manifest; else `interruption` is
  /// empty. True if the recording is complete.
  bool finish(const std::string& interruption, std::uint64_t refused_samples,
              const std::string& outcome = "interrupted");

  /// The same for a recorder: with the end that its watch has found.
  RecorderCore::Recorded close(const RunWatch::End& end, std::uint64_t refused_samples);

  /// After `finish`: why the recording is not complete, in one line.
  std::string describe_gaps() const { return core_.describe_gaps(); }

 private:
  bool add(const StepRows& rows) override;
  void add(const SimStatus& status, bool is_repeated) override;
  void add_event(const std::string& text) override { log_.add_event(text); }
  bool has_new_stage() const override { return log_.list_stage_starts() != stage_starts_; }
  void write_manifest(const Claims& claims) override;
  void flush() override;
  void log(const sync::Line& line) override;

  void read_earlier_segments();
  Manifest make_manifest(const Claims& claims) const;

  const Segment segment_;
  const Parameters parameters_;
  const config::Scenario scenario_;
  const std::vector<std::unique_ptr<RecordSink>> sinks_;
  FlightLog log_;
  Certificate certificate_;
  RecordingCore core_;
  std::vector<StageStart> stage_starts_;  // those in the last manifest
};

}  // namespace sls::record
