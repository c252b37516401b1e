/// One recording on disk: takes the steps and status samples of one run and writes the files. No
/// network here; used by one thread.
#pragma once

#include <chrono>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "common/bus/topics.hpp"
#include "common/config/scenario.hpp"
#include "recorder/certificate.hpp"
#include "recorder/flight_log.hpp"
#include "recorder/manifest.hpp"
#include "recorder/recording_folder.hpp"
#include "recorder/sinks/record_sink.hpp"
#include "recorder/stream.hpp"

namespace sls::record {

class Recording {
 public:
  /// Opens the files in the segment's folder, which must be ready, reads the earlier segments and
  /// writes a manifest with the outcome "recording", not complete.
  /// @throws config::ConfigError if the scenario or the signals in `parameters` cannot be used, or
  ///   the scenario is not that of the earlier segments.
  /// @throws DamagedError if an earlier segment cannot be read.
  /// Every member @throws std::system_error with the name of the file if it cannot be written.
  Recording(const Segment& segment, const Parameters& parameters);
  /// For a recording of one segment.
  Recording(const std::filesystem::path& folder, const Parameters& parameters);

  /// Adds the next step of a vehicle of a run in this process.
  void add(const model::StepRecord& record);
  /// Samples of other runs are ignored.
  void add(const RecordBatch& batch);
  void add(const SimStatus& status);

  /// Notes that a controller of the run has loaded a shared library.
  void note_library(const std::string& controller, const std::string& sha256);

  /// Adds elapsed time: after a limit, a lost batch is no longer waited for.
  void pass_time(Stream::Duration elapsed) { stream_.pass_time(elapsed); }

  /// A text with the missing batch, if the recording has waited for it at least `patience`.
  std::optional<std::string> describe_stuck(Stream::Duration patience) const {
    return stream_.describe_stuck(patience);
  }

  /// Flushes the files if the last flush is `record.flush_s` ago.
  void flush_if_due();

  /// True when the run has ended and its last batch has been handled.
  bool has_all() const { return has_ended() && stream_.has_ended(); }

  /// True when the run was ended by an operator's reset.
  bool is_reset() const { return last_status_ && last_status_->phase() == RunPhase::PHASE_RESET; }

  /// The last step up to which all steps of all vehicles have come or are known to be missing; −1:
  /// none. The last 64 of them may wait for late answers before they are written.
  std::int64_t last_complete_step() const { return stream_.last_step(); }

  /// Writes pending rows, flight.txt and the final manifest. If the recorder stops early,
  /// `interruption` is the reason and `outcome` the outcome in the manifest; else `interruption` is
  /// empty. True if the recording is complete.
  bool finish(const std::string& interruption, std::uint64_t refused_samples,
              const std::string& outcome = "interrupted");

  /// After `finish`: why the recording is not complete, in one line.
  std::string describe_gaps() const;

 private:
  void read_earlier_segments();
  void write_provisional_manifest();
  void write(const StepRows& rows);
  void account(const StepRows& rows);
  void note_missing(std::uint32_t vehicle_id, const char* topic, std::uint64_t from,
                    std::uint64_t to);
  void note_missing_steps(std::uint32_t vehicle_id, std::uint64_t from, std::uint64_t to);
  void note_missing_answers(std::uint32_t vehicle_id, std::uint64_t from, std::uint64_t to);
  void note_missing_end();
  void note_status(std::uint64_t sample_index);
  bool has_ended() const;
  bool is_finished() const;
  void flush();
  Manifest make_manifest() const;

  const Segment segment_;
  const Parameters parameters_;
  const config::Scenario scenario_;
  const std::vector<std::unique_ptr<RecordSink>> sinks_;
  FlightLog log_;
  Certificate certificate_;
  Stream stream_;
  std::map<std::string, std::string> libraries_;  // of controllers, by name
  MissingSamples missing_;
  std::vector<StageStart> stage_starts_;  // those in the provisional manifest
  struct LastGap {
    std::uint64_t to = 0;
    std::size_t index = 0;  // in missing_.listed; its greatest size if it is not listed
  };
  std::map<std::pair<std::uint32_t, std::string>, LastGap> last_gaps_;  // of vehicle and topic
  std::map<std::uint32_t, std::uint64_t> bare_steps_;  // last steps with a state but no answer
  std::uint64_t unanswered_steps_ = 0;
  std::optional<SimStatus> last_status_;
  std::uint64_t next_status_ = 0;      // sample_index after the last one of all segments
  std::string interruption_;           // set by `finish`
  std::uint64_t refused_samples_ = 0;  // set by `finish`
  std::chrono::steady_clock::time_point flush_time_;
};

}  // namespace sls::record
