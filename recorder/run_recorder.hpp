/// Records one run, from joining it to its end. It has two threads in addition to those of the
/// middleware: the main thread watches the run and announces progress; the other one writes,
/// because a slow disk must not delay the main thread.
#pragma once

#include <atomic>
#include <chrono>
#include <exception>
#include <optional>
#include <string>

#include "common/app/wait.hpp"
#include "common/bus/node.hpp"
#include "common/bus/participants.hpp"
#include "common/config/scenario.hpp"
#include "recorder/core/run_watch.hpp"
#include "recorder/inbox.hpp"
#include "recorder/recording.hpp"

namespace sls::record {

/// Objects that outlive a run.
struct Surroundings {
  /// Runs with the vehicle `flown_vehicle` are recorded.
  Surroundings(bus::Node& domain, std::uint32_t flown_vehicle)
      : vehicle(flown_vehicle),
        participants(domain),
        servers(domain),
        announcer(domain),
        inbox(domain, [this](std::uint64_t run_id) { return servers.may_fly(run_id, vehicle); }) {}

  const std::uint32_t vehicle;
  bus::ParticipantDirectory participants;
  bus::ServerDirectory servers;
  bus::Announcer announcer;
  Inbox inbox;
};

struct RunEnd {
  bool is_complete = false;
  bool is_reset = false;                 ///< by an operator: the same server begins a new run
  std::optional<sync::Run> replacement;  ///< a run of another server that replaces this one
  std::string gaps;                      ///< why it is not complete, in one line
  std::int64_t last_step = -1;
};

class RunRecorder {
 public:
  /// Opens the recording of `run` in `segment`.
  RunRecorder(Surroundings& surroundings, const sync::Run& run, const Segment& segment);

  /// Records until the end of the run.
  /// @throws the error of the writing thread, such as std::system_error if a file cannot be
  ///   written, after it has announced the end to the other programs.
  RunEnd run();

 private:
  using Clock = std::chrono::steady_clock;

  // On the main thread.
  void watch();
  RunWatch::Now look_around() const;
  void announce(bool done);

  // On the writing thread.
  void write_samples();
  void note_libraries();
  void report_missing_batch();

  Surroundings& surroundings_;
  const sync::Run run_;
  const std::uint64_t run_id_;
  const config::Scenario scenario_;
  Recording recording_;  // used only by the writing thread while that runs
  std::optional<app::Wait> stuck_;
  std::uint64_t participants_version_ = 0;

  RunWatch watch_;
  RunEnd end_;

  // Shared by both threads.
  std::atomic<bool> stop_writing_{false};
  std::atomic<bool> has_all_{false};
  std::atomic<std::int64_t> last_complete_step_;
  RunWatch::End watched_end_;         // set before stop_writing_
  std::exception_ptr writing_error_;  // read after the thread has ended
  std::atomic<bool> writing_failed_{false};
};

/// Announcement of a recorder; `run` is the joined run, or null.
Participant make_announcement(const sync::Run* run, bool ready, bool done, std::int64_t last_step);

}  // namespace sls::record
