#include "recorder/run_recorder.hpp"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <thread>
#include <utility>

#include "common/app/log.hpp"
#include "common/app/scheduling.hpp"
#include "common/app/stop_signal.hpp"

namespace sls::record {
namespace {

using namespace std::chrono_literals;

constexpr auto kPollTime = 5ms;   // period of the main thread
constexpr auto kWriteTime = 5ms;  // period of the writing thread
constexpr auto kBusyTime = 1ms;   // the same while samples come
constexpr auto kStuckTime = 1s;   // before a missing batch is reported

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
      watch_(run, surroundings.vehicle, scenario_.sync.wait.server_deadline_s, Clock::now()),
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
    watched_end_ = watch_.end();
  } catch (...) {
    watching_error = std::current_exception();
    watched_end_.interruption = "the recorder failed";
  }
  stop_writing_ = true;
  writing.join();
  if (watching_error) std::rethrow_exception(watching_error);
  announce(true);
  if (writing_error_) std::rethrow_exception(writing_error_);
  end_.is_reset = watched_end_.is_reset || recording_.is_reset();
  end_.replacement = watched_end_.replacement;
  end_.last_step = last_complete_step_;
  return end_;
}

// --- watching ------------------------------------------------------------------------------------

void RunRecorder::watch() {
  while (!has_all_ && !writing_failed_) {
    const RunWatch::Now now = look_around();
    const bool is_over = surroundings_.servers.ask(
        [&](const sync::Servers& servers) { return watch_.look(servers, now); });
    for (const sync::Line& line : watch_.take_lines()) app::log(line);
    if (is_over) return;
    surroundings_.servers.look_for_impostors();
    if (watch_.is_announcement_due(now)) announce(false);
    std::this_thread::sleep_for(kPollTime);
  }
}

RunWatch::Now RunRecorder::look_around() const {
  return {Clock::now(), app::describe_stop(), surroundings_.inbox.hears(run_.server),
          last_complete_step_};
}

void RunRecorder::announce(bool done) {
  const RunWatch::Now now = look_around();
  watch_.note_announcement(now);
  surroundings_.announcer.announce(make_announcement(&run_, watch_.is_ready() && !writing_failed_,
                                                     done, now.last_complete_step));
}

// --- writing -------------------------------------------------------------------------------------

void RunRecorder::write_samples() {
  try {
    bool is_stopped = false;
    auto time = Clock::now();
    while (!recording_.has_all() && !is_stopped) {
      is_stopped = stop_writing_;  // read first: samples that came before it are still written
      const bool has_come = surroundings_.inbox.empty_into(recording_);
      note_libraries();
      const auto earlier = std::exchange(time, Clock::now());
      recording_.pass_time(std::min(time - earlier, kLongestPass));
      recording_.flush_if_due();
      last_complete_step_ = recording_.last_complete_step();
      report_missing_batch();
      std::this_thread::sleep_for(has_come ? kBusyTime : kWriteTime);
    }
    // If it has all, the main thread may still write watched_end_.
    const bool has_all = recording_.has_all();
    end_.is_complete =
        recording_.finish(has_all ? "" : watched_end_.interruption, surroundings_.inbox.refused(),
                          has_all ? "" : watched_end_.outcome);
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
