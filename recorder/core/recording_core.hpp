/// The rows of a recording, the samples that it lacks, its end, and the claims of its manifest. No
/// file, network, thread or clock here: the shell (recorder/recording.hpp) writes.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>

#include "common/model/step_record.hpp"
#include "common/sync/line.hpp"
#include "common/sync/time.hpp"
#include "recorder/core/gaps.hpp"
#include "recorder/core/stream.hpp"
#include "sls.h"

namespace sls::record {

/// The claims of a manifest about the run and the samples that were received.
struct Claims {
  bool complete = false;  ///< the mission finished and nothing is missing
  std::string outcome;    ///< recording, finished, failed, reset, interrupted, lost
  std::string reason;
  std::string timing;  ///< the last timing label of the server
  std::uint64_t last_step = 0;
  MissingSamples missing;
  std::uint64_t unanswered_steps = 0;  ///< flown with a held answer or the fail-safe force
  std::uint64_t refused_samples = 0;   ///< lost because the recorder's queue was full
  DroppedEntries dropped;
  std::map<std::string, std::string> libraries;  ///< SHA-256 of controllers' libraries, by name
};

/// The orders of the core. A function that throws, because a file cannot be written, ends the
/// recording: the core is not called again.
class RecordingOutputs {
 public:
  /// Adds the rows of a step to the files and the summary. True if the files must be flushed.
  virtual bool add(const StepRows& rows) = 0;
  /// Adds a status sample. One that is repeated has its row and its event in an earlier segment.
  virtual void add(const SimStatus& status, bool is_repeated) = 0;
  /// Adds a line to the events of the flight.
  virtual void add_event(const std::string& text) = 0;
  /// True if a stage has begun whose start the last manifest lacks.
  virtual bool has_new_stage() const = 0;
  virtual void write_manifest(const Claims& claims) = 0;
  virtual void flush() = 0;
  virtual void log(const sync::Line& line) = 0;

 protected:
  ~RecordingOutputs() = default;
};

/// An earlier end of a recording than that of its run.
struct Interruption {
  std::string reason;  ///< empty: there is none
  std::string outcome = "interrupted";
};

class RecordingCore {
 public:
  enum class Phase {
    kReceiving,  ///< samples may still come
    kWhole,      ///< the run has ended and its last batch has been handled
    kEnded,      ///< on_end: further events change nothing
  };

  /// Begins at `now` with empty files, which are flushed every `flush_s`. Steps before `first_step`
  /// are left out.
  RecordingCore(const Parameters& parameters, std::uint64_t first_step, double flush_s,
                sync::Time now, RecordingOutputs& outputs);

  // Of the earlier segments, in this order and before the other events: each step, their end, each
  // status sample. Their gaps are those of the whole flight.
  void on_earlier_step(const StepRows& rows);
  void on_earlier_end();
  void on_earlier_status(std::uint64_t sample_index) { note_status(sample_index); }

  /// The next step of a vehicle of a run in this process. Not together with batches.
  void on_step(const model::StepRecord& record);
  /// Samples of other runs are ignored.
  void on_batch(const RecordBatch& batch, sync::Time now);
  void on_status(const SimStatus& status);
  /// A controller of the run has loaded a shared library.
  void on_library(const std::string& controller, const std::string& sha256);
  /// Call it several times a second, after the samples that have come.
  void on_time(sync::Time now);
  /// No further samples. Hands on all rows and returns what the last manifest claims. A recording
  /// that is whole is not interrupted.
  Claims on_end(const Interruption& interruption, std::uint64_t refused_samples);
  void flush();

  Phase phase() const { return phase_; }
  /// True if `phase` is the last one that the server of the run has published.
  bool has_phase(RunPhase phase) const { return last_status_ && last_status_->phase() == phase; }
  /// As Stream::last_step.
  std::int64_t last_complete_step() const { return stream_.last_step(); }
  /// The claims of a manifest while the recorder runs, or if it was killed.
  Claims make_claims() const;
  /// After `on_end`: why the recording is not complete, in one line.
  std::string describe_gaps() const;

 private:
  void write(const StepRows& rows);
  void account(const StepRows& rows);
  void note_missing_steps(std::uint32_t vehicle_id, std::uint64_t from, std::uint64_t to);
  void note_missing_answers(std::uint32_t vehicle_id, std::uint64_t from, std::uint64_t to);
  void note_missing_end();
  void note_status(std::uint64_t sample_index);
  void note_whole();
  bool is_finished() const { return has_phase(RunPhase::PHASE_FINISHED); }
  bool has_run_ended() const {
    return is_finished() || has_phase(RunPhase::PHASE_RESET) || has_phase(RunPhase::PHASE_FAILED);
  }

  const std::uint64_t run_id_;
  const sync::Duration flush_time_;
  RecordingOutputs& outputs_;
  Phase phase_ = Phase::kReceiving;
  Stream stream_;
  GapList gaps_;
  std::map<std::uint32_t, std::uint64_t> earlier_;     // steps after those of earlier segments
  std::map<std::uint32_t, std::uint64_t> bare_steps_;  // last steps with a state but no answer
  std::optional<SimStatus> last_status_;
  std::uint64_t next_status_ = 0;  // sample_index after the last one of all segments
  sync::Time time_, flushed_;
  std::string interruption_;
  Claims claims_;  // of it, only what is counted: unanswered steps, refused samples, libraries
};

}  // namespace sls::record
