/// Records one run, from joining it to its end. Two threads beside the middleware's: the main one
/// watches the run and announces progress; the other one writes, because a slow disk must not delay
/// the watching.
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
#include "recorder/inbox.hpp"
#include "recorder/recording.hpp"

namespace sls::record {

/// Objects that outlive a run.
struct Surroundings {
  /// Runs that fly `flown_vehicle` are recorded.
  Surroundings(bus::Node& domain, std::uint32_t flown_vehicle)
      : vehicle(flown_vehicle),
        participants(domain),
        servers(domain),
        participant_writer(domain),
        inbox(domain, [this](std::uint64_t run_id) { return servers.may_fly(run_id, vehicle); }) {}

  const std::uint32_t vehicle;
  bus::ParticipantDirectory participants;
  bus::ServerDirectory servers;
  bus::Writer<Participant> participant_writer;
  Inbox inbox;
};

struct RunEnd {
  bool is_complete = false;
  bool is_reset = false;                ///< by an operator: the same server goes on with a new run
  std::optional<bus::Run> replacement;  ///< another server's, which has taken the place of this one
  std::string gaps;                     ///< why it is not complete, in one line
  std::int64_t last_step = -1;
};

class RunRecorder {
 public:
  /// Opens the recording of `run` in `segment`.
  RunRecorder(Surroundings& surroundings, const bus::Run& run, const Segment& segment);

  /// @throws what the disk refuses, after the others have been told.
  RunEnd run();

 private:
  using Clock = std::chrono::steady_clock;

  // On the main thread.
  void watch();
  void look_for_the_end(bus::ServerWatch& server);
  void look_for_the_next_run();
  void end_within(std::chrono::duration<double> limit);
  void announce_news();
  void announce(bool done);

  // On the writing thread.
  void write_samples();
  void note_libraries();
  void report_missing_batch();

  Surroundings& surroundings_;
  const bus::Run run_;
  const std::uint64_t run_id_;
  const config::Scenario scenario_;
  Recording recording_;  // the writing thread's while it runs
  std::optional<app::Wait> stuck_;
  std::uint64_t participants_version_ = 0;

  bool ready_ = false;
  std::int64_t announced_step_ = -1;
  Clock::time_point announced_time_;
  std::optional<app::Wait> give_up_;
  std::int64_t step_after_end_ = -1;  // the last complete one when last looked at
  RunEnd end_;

  // Shared by the two.
  std::atomic<bool> stop_writing_{false};
  std::atomic<bool> has_all_{false};
  std::atomic<std::int64_t> last_complete_step_;
  std::string interruption_;             // set before stop_writing_
  std::string outcome_ = "interrupted";  // likewise
  std::exception_ptr writing_error_;     // read after the thread has ended
  std::atomic<bool> writing_failed_{false};
};

/// Announcement of a recorder; `run` is the one it serves, where it knows one.
Participant make_announcement(const bus::Run* run, bool ready, bool done, std::int64_t last_step);

}  // namespace sls::record
