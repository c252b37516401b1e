#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <exception>
#include <thread>

#include "common/bus/participants.hpp"
#include "recorder/core/recorder_core.hpp"
#include "recorder/inbox.hpp"
#include "recorder/recording.hpp"

namespace sls::record {

/// The thread that writes the recording of a run, from the inbox to the disk. It is not the main
/// thread, because a slow disk must not delay that.
class WritingThread {
 public:
  static constexpr auto kWriteTime = std::chrono::milliseconds(5);  ///< between two passes
  static constexpr auto kBusyTime = std::chrono::milliseconds(1);   ///< while samples come

  /// Opens the recording of `run` in `segment`.
  WritingThread(Inbox& inbox, const bus::ParticipantDirectory& participants, const sync::Run& run,
                const Segment& segment);
  /// Closes the recording as interrupted if it is not closed.
  ~WritingThread();

  void start();
  /// Writes what has come so far and closes the recording. Call it once.
  void close(const RunWatch::End& end);
  bool has_ended() const { return has_ended_; }
  bool has_failed() const { return has_ended_ && error_; }
  std::int64_t last_complete_step() const { return last_complete_step_; }
  /// After the end.
  /// @throws the error of the thread, such as std::system_error if a file cannot be written.
  const RecorderCore::Recorded& recorded() const;

 private:
  void work();
  void write_samples();
  void note_libraries();

  Inbox& inbox_;
  const bus::ParticipantDirectory& participants_;
  const std::uint64_t run_id_;
  Recording recording_;  // used only by the thread while that runs
  std::uint64_t participants_version_ = 0;
  std::atomic<std::int64_t> last_complete_step_;
  RunWatch::End end_;  // set before must_close_
  std::atomic<bool> must_close_{false};
  RecorderCore::Recorded recorded_;  // this and error_: set before has_ended_
  std::exception_ptr error_;
  std::atomic<bool> has_ended_{false};
  std::thread thread_;  // last: it uses the members above
};

}  // namespace sls::record
