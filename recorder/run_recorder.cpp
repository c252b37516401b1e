#include "recorder/run_recorder.hpp"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <csignal>
#include <thread>
#include <utility>

#include "common/app/scheduling.hpp"
#include "common/app/stop_signal.hpp"

namespace sls::record {
namespace {

using namespace std::chrono_literals;

constexpr auto kPollTime = 5ms;            // period of the main thread
constexpr auto kNewsTime = 20ms;           // least time between two announcements of new steps
constexpr std::int64_t kManySteps = 500;   // announced at once: the server may wait for it
constexpr auto kAnnounceTime = 500ms;      // longest time between two announcements
constexpr auto kWriteTime = 5ms;           // period of the writing thread
constexpr auto kBusyTime = 1ms;            // the same while samples come
constexpr auto kStuckTime = 1s;            // before a missing batch is reported
constexpr auto kCompletionTime = 10s;      // wait for each step after the end of a finished run
constexpr auto kFailedTime = 1s;           // wait after the end of any other run
constexpr auto kInterruptionTime = 500ms;  // wait after a stop signal

/// Longest time that counts as waiting in one period: while this process is stopped, no sample can
/// arrive.
constexpr std::chrono::steady_clock::duration kLongestPass = 1s;

}  // namespace

Participant make_announcement(const sync::Run* run, bool ready, bool done, std::int64_t last_step) {
  Participant message;
  message.contract_sha256(bus::kContractSha256);
  message.role(ParticipantRole::ROLE_RECORDER);
  message.name("recorder");
  message.host(bus::host_name());
  if (run) {
    message.run_id(run->parameters.run_id());
    message.scenario_sha256(run->parameters.scenario_sha256());
  }
  message.ready(ready);
  message.done(done);
  message.last_complete_step(last_step);
  return message;
}

RunRecorder::RunRecorder(Surroundings& surroundings, const sync::Run& run, const Segment& segment)
    : surroundings_(surroundings),
      run_(run),
      run_id_(run.parameters.run_id()),
      scenario_(
          config::parse_scenario(run.parameters.scenario_text().to_string(), "sls/parameters")),
      recording_(segment, run.parameters),
      last_complete_step_(recording_.last_complete_step()) {
  surroundings.inbox.open(run_id_, run.server);
  spdlog::info("records run {:016x} of '{}' into {}{}", run_id_, scenario_.name,
               segment.folder.string(),
               segment.first_step > 0 ? fmt::format(", from step {}", segment.first_step) : "");
}

RunEnd RunRecorder::run() {
  announce(false);
  // A process that writes into a port of shared memory waits for its reader, even if the reader has
  // just lost its processor.
  if (run_.parameters.mode() == SyncMode::MODE_REALTIME) app::put_process_first();
  std::thread writing([this] {
    app::put_thread_last();
    write_samples();
  });
  std::exception_ptr watching_error;  // kept until the thread has closed its files
  try {
    watch();
  } catch (...) {
    watching_error = std::current_exception();
    interruption_ = "the recorder failed";
  }
  stop_writing_ = true;
  writing.join();
  if (watching_error) std::rethrow_exception(watching_error);
  announce(true);
  if (writing_error_) std::rethrow_exception(writing_error_);
  end_.is_reset = end_.is_reset || recording_.is_reset();
  end_.last_step = last_complete_step_;
  return end_;
}

// --- watching ------------------------------------------------------------------------------------

void RunRecorder::watch() {
  bus::ServerWatch server(surroundings_.servers, run_, scenario_.sync.wait.server_deadline_s);
  while (!has_all_ && !writing_failed_) {
    look_for_the_end(server);
    surroundings_.servers.look_for_impostors();
    if (give_up_ && give_up_->is_over()) return;
    if (give_up_ && give_up_->is_report_due())
      spdlog::info("waiting for: samples after step {} of run {:016x} ({:.0f} s left)",
                   last_complete_step_.load(), run_id_, give_up_->seconds_left());
    announce_news();
    std::this_thread::sleep_for(kPollTime);
  }
}

void RunRecorder::look_for_the_end(bus::ServerWatch& server) {
  const auto status = surroundings_.servers.find_status(run_id_);
  if (app::stop_signal() != 0) {
    interruption_ =
        app::stop_signal() == SIGINT ? "interrupted by SIGINT" : "interrupted by SIGTERM";
    end_within(kInterruptionTime);
  } else if (status && status->phase() == RunPhase::PHASE_FINISHED) {
    end_within(kCompletionTime);
    const std::int64_t step = last_complete_step_;
    if (step > std::exchange(step_after_end_, step)) give_up_->renew();
  } else if (status && (status->phase() == RunPhase::PHASE_FAILED ||
                        status->phase() == RunPhase::PHASE_RESET)) {
    end_within(kFailedTime);
  } else if (!give_up_) {
    const auto finding = server.look();
    if (finding == sync::ServerWatch::Finding::kSilent) look_for_the_next_run();
    if (finding != sync::ServerWatch::Finding::kLost) return;
    outcome_ = "lost";
    interruption_ = fmt::format("the {}, given up after {} s", server.describe(),
                                scenario_.sync.wait.server_deadline_s);
    end_within(0s);
  }
}

/// Ends this run if another one replaces it: of the same server, or of a server that replaces it.
void RunRecorder::look_for_the_next_run() {
  const auto next = surroundings_.servers.find_successor(run_, {surroundings_.vehicle});
  if (!next) return;
  end_.is_reset = next->server == run_.server;
  if (!end_.is_reset) end_.replacement = next;
  outcome_ = end_.is_reset ? "reset" : "lost";
  interruption_ =
      fmt::format("run {:016x} was replaced by run {:016x}", run_id_, next->parameters.run_id());
  spdlog::warn("{}", interruption_);
  end_within(kFailedTime);
}

void RunRecorder::end_within(std::chrono::duration<double> limit) {
  if (!give_up_ || give_up_->seconds_left() > limit.count()) give_up_.emplace(limit.count());
}

void RunRecorder::announce_news() {
  const bool is_now_ready = !ready_ && surroundings_.inbox.hears(run_.server);
  ready_ = ready_ || is_now_ready;
  const auto age = Clock::now() - announced_time_;
  const std::int64_t news = last_complete_step_ - announced_step_;
  if (is_now_ready || age >= kAnnounceTime || news >= kManySteps || (news > 0 && age >= kNewsTime))
    announce(false);
}

void RunRecorder::announce(bool done) {
  announced_step_ = last_complete_step_;
  announced_time_ = Clock::now();
  surroundings_.announcer.announce(
      make_announcement(&run_, ready_ && !writing_failed_, done, announced_step_));
}

// --- writing -------------------------------------------------------------------------------------

void RunRecorder::write_samples() {
  try {
    bool is_stopped = false;
    auto time = Clock::now();
    while (!recording_.has_all() && !is_stopped) {
      is_stopped = stop_writing_;  // read first: samples that came before it are still written
      const std::deque<Inbox::Sample> samples = surroundings_.inbox.take_all();
      for (const Inbox::Sample& sample : samples)
        std::visit([this](const auto& message) { recording_.add(message); }, sample);
      note_libraries();
      const auto earlier = std::exchange(time, Clock::now());
      recording_.pass_time(std::min(time - earlier, kLongestPass));
      recording_.flush_if_due();
      last_complete_step_ = recording_.last_complete_step();
      report_missing_batch();
      std::this_thread::sleep_for(samples.empty() ? kWriteTime : kBusyTime);
    }
    // If it has all, the main thread may still write interruption_.
    const bool has_all = recording_.has_all();
    end_.is_complete = recording_.finish(has_all ? "" : interruption_,
                                         surroundings_.inbox.refused(), has_all ? "" : outcome_);
    if (!end_.is_complete) end_.gaps = recording_.describe_gaps();
    last_complete_step_ = recording_.last_complete_step();
    has_all_ = true;
  } catch (...) {
    writing_error_ = std::current_exception();
    writing_failed_ = true;
  }
}

void RunRecorder::note_libraries() {
  const std::uint64_t version = surroundings_.participants.version();
  if (std::exchange(participants_version_, version) == version) return;
  for (const auto& entry :
       surroundings_.participants.find(ParticipantRole::ROLE_CONTROLLER, run_id_))
    if (entry.announcement.library_sha256().size() > 0)
      recording_.note_library(entry.announcement.name().to_string(),
                              entry.announcement.library_sha256().to_string());
}

void RunRecorder::report_missing_batch() {
  const auto batch = recording_.describe_stuck(kStuckTime);
  if (!batch) return stuck_.reset();
  if (!stuck_) stuck_.emplace(0.0, Clock::duration::zero());
  if (stuck_->is_report_due()) spdlog::warn("waiting for: {}", *batch);
}

}  // namespace sls::record
