#pragma once

#include <deque>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>

#include "recorder/core/arrivals.hpp"
#include "recorder/core/recorder_core.hpp"
#include "recorder/recorder.hpp"
#include "worlds/program.hpp"
#include "worlds/world_recording.hpp"

namespace sls::worlds {

/// A recorder: RecorderCore and RecordingCore with a simulated shell (recorder/recorder.hpp and
/// writing_thread.hpp are the real one).
class RecorderProgram : public Program {
 public:
  struct Options {
    std::filesystem::path folder;  ///< of real files; empty: rows in memory
    std::uint32_t vehicle = 0;     ///< its run is recorded
    bool resumes = false;
    bool follows_servers = false;
    std::size_t queue = record::Arrivals::kMostEntries;  ///< entries that wait to be written
    Instant disk_delay{0};  ///< extra time of each pass of the writing thread
  };
  RecorderProgram(Setting& setting, Host& host, std::string name, const Options& options);
  void start() override;
  /// Those in memory, oldest first.
  const std::deque<StoredRecording>& recordings() const { return recordings_; }
  const std::filesystem::path& folder() const { return options_.folder; }
  bool has_recorded() const { return has_recorded_; }
  /// The disk is full, or has room again, for files and for rows in memory.
  void set_disk_full(bool is_full) { is_disk_full_ = is_full; }
  /// The last recording that was closed is complete.
  bool is_complete() const { return recorded_.is_complete; }

 private:
  void wake() override;
  void act(record::RecorderCore::Act act);
  record::RecorderCore::Now look_around();
  void open();
  void report();
  bool is_heard() const;
  void announce_progress();
  /// A pass of the writing thread.
  void write();
  bool write_samples();
  void note_newest(const RecordBatch& batch);
  /// write(2) on a disk that takes only a part of every fifth write, and nothing when it is full.
  ssize_t write_to_disk(int descriptor, const void* bytes, std::size_t size);
  void on_killed() override { writing_.reset(); }

  const Options options_;
  record::RecorderOptions recorder_options_;
  std::unique_ptr<record::RecorderCore> core_;  // null if the folder was refused
  record::Arrivals arrivals_;
  std::deque<StoredRecording> recordings_;

  std::unique_ptr<WorldRecording> writing_;       // of the run that is recorded
  std::int64_t first_progress_ = -1;              // of this run, when the recording was opened
  std::map<std::uint32_t, std::int64_t> newest_;  // step that came to be written, by vehicle
  std::optional<record::RunWatch::End> must_close_;
  bool has_recorded_ = false;
  bool is_disk_full_ = false;
  Random disk_;          // which writes are short
  std::string failure_;  // of the writing thread
  bool has_closed_ = false;
  record::RecorderCore::Recorded recorded_;
  std::optional<sync::Time> acknowledged_by_;  // the end of a wait
};

}  // namespace sls::worlds
