#include "recorder/core/recorder_core.hpp"

#include <spdlog/fmt/fmt.h>

#include <algorithm>

namespace sls::record {
namespace {

constexpr double kJoinTimeout = 60;                                 // until a run is found, s
constexpr sync::Duration kLookTime = std::chrono::milliseconds(5);  // between two looks

std::string to_text(std::uint64_t run_id) { return fmt::format("{:016x}", run_id); }

std::uint32_t choose_vehicle(const RecorderCore::Options& options) {
  if (!options.unfinished) return options.vehicle;
  const auto& ids = options.unfinished->vehicle_ids;
  const bool is_among = std::find(ids.begin(), ids.end(), options.vehicle) != ids.end();
  return is_among || ids.empty() ? options.vehicle : ids.front();
}

}  // namespace

RecorderCore::RecorderCore(Options options)
    : options_(std::move(options)), vehicle_(choose_vehicle(options_)), limit_s_(kJoinTimeout) {}

Participant RecorderCore::make_announcement(std::int64_t last_complete_step,
                                            bool has_failed) const {
  Participant message = options_.identity;
  message.role(ParticipantRole::ROLE_RECORDER);
  message.name("recorder");
  if (phase_ != Phase::kFinding && phase_ != Phase::kEnded) {
    message.run_id(run_->parameters.run_id());
    message.scenario_sha256(run_->parameters.scenario_sha256());
  }
  message.ready(is_ready() && !has_failed);
  message.done(phase_ == Phase::kClosed);
  message.last_complete_step(last_complete_step);
  return message;
}

RecorderCore::Act RecorderCore::look(const sync::Servers& servers, const Now& now) {
  deadline_ = now.time + kLookTime;
  if (phase_ == Phase::kFinding) return find(servers, now);
  if (phase_ == Phase::kRecording || phase_ == Phase::kClosing) return watch(servers, now);
  return Act::kNone;  // on_opened and on_recorded end the other phases
}

// --- which run -----------------------------------------------------------------------------------

RecorderCore::Act RecorderCore::find(const sync::Servers& servers, const Now& now) {
  if (!now.interruption.empty()) return end();
  if (const auto run = find_run(servers, now.time)) return open(*run);
  const bool was_reset = run_ && !watch_->end().replacement;
  const auto status = was_reset ? servers.find_status(run_->parameters.run_id()) : nullptr;
  // A reset can fail after it has ended the run. Its server then has no other one.
  if (status && status->phase() == RunPhase::PHASE_FAILED)
    return end(fmt::format("{}: no run after the reset of run {}: {}", options_.folder,
                           to_text(run_->parameters.run_id()), status->reason().c_str()));
  if (!patience_) patience_.emplace(now.time, limit_s_, sync::kUsualJoinTime);
  const std::string ended = run_ ? to_text(run_->parameters.run_id()) : "";
  if (patience_->is_over(now.time))
    return end(run_ ? fmt::format("{}: no run within {} s of the reset of run {}", options_.folder,
                                  limit_s_, ended)
                    : fmt::format("{}: nothing recorded: no server within {} s", options_.folder,
                                  limit_s_));
  if (!patience_->is_report_due(now.time)) return Act::kNone;
  const std::string whom = run_                  ? "the run after the reset of run " + ended
                           : options_.unfinished ? "server of run " + options_.unfinished->run_id
                                                 : "server";
  lines_.push_back({false, fmt::format("waiting for: {} ({:.0f} s left)", whom,
                                       patience_->seconds_left(now.time))});
  return Act::kNone;
}

std::optional<sync::Run> RecorderCore::find_run(const sync::Servers& servers,
                                                sync::Time now) const {
  if (!run_) return find_first_run(servers, now);
  // It may have left since it was seen.
  const auto& replacement = watch_->end().replacement;
  if (replacement && servers.is_known(replacement->parameters.run_id(), now)) return replacement;
  auto next = servers.find_successor(*run_, {vehicle_}, now);
  if (next && !(next->server == run_->server) && !options_.follows_servers) return std::nullopt;
  return next;
}

/// A run of the unfinished recording, even if it has just ended, comes before others.
std::optional<sync::Run> RecorderCore::find_first_run(const sync::Servers& servers,
                                                      sync::Time now) const {
  if (options_.unfinished)
    for (const sync::Run& run : servers.runs(now)) {
      const std::uint64_t id = run.parameters.run_id();
      if (to_text(id) == options_.unfinished->run_id || options_.has_subfolder(id)) return run;
    }
  return servers.find_joinable(vehicle_, now);
}

// --- where it goes -------------------------------------------------------------------------------

RecorderCore::Act RecorderCore::open(const sync::Run& run) {
  const auto place = choose_place(run.parameters.run_id());
  run_ = run;
  if (!place)
    return end(fmt::format(
        "{}: run {} was replaced by run {}: expected the one that is to be resumed "
        "(--follow records the other one into a subfolder)",
        options_.folder, options_.unfinished->run_id, to_text(run.parameters.run_id())));
  place_ = *place;
  phase_ = Phase::kOpening;
  return Act::kOpen;
}

/// Nothing if the run has no place.
std::optional<RecorderCore::Place> RecorderCore::choose_place(std::uint64_t run_id) const {
  if (run_) return Place::kSubfolder;
  if (!options_.unfinished) return Place::kFolder;
  if (options_.unfinished->run_id == to_text(run_id)) return Place::kNextSegment;
  if (options_.follows_servers || options_.has_subfolder(run_id) ||
      options_.unfinished->outcome == "reset")
    return Place::kSubfolder;
  return std::nullopt;
}

// --- its end -------------------------------------------------------------------------------------

void RecorderCore::on_opened(double server_deadline_s, const RunWatch::Now& now) {
  if (phase_ != Phase::kOpening) return;  // nothing was to be opened
  watch_.emplace(*run_, vehicle_, server_deadline_s, now);
  limit_s_ = server_deadline_s;
  phase_ = Phase::kRecording;
}

RecorderCore::Act RecorderCore::watch(const sync::Servers& servers, const Now& now) {
  if (now.is_closed) {
    phase_ = Phase::kClosed;
    return Act::kReport;
  }
  if (phase_ == Phase::kRecording) {
    const bool is_over = watch_->look(servers, now);
    for (sync::Line& line : watch_->take_lines()) lines_.push_back(std::move(line));
    if (is_over) {
      phase_ = Phase::kClosing;
      return Act::kClose;
    }
  }
  return watch_->is_announcement_due(now) ? Act::kAnnounce : Act::kNone;
}

void RecorderCore::on_recorded(const Recorded& recorded, const std::string& interruption) {
  if (phase_ != Phase::kClosed) return;  // nothing was recorded
  if (recorded.is_complete) {
    lines_.push_back(
        {false, fmt::format("{}: complete, {} steps", options_.folder, recorded.last_step)});
    end();
    return;
  }
  const bool is_stopped = !interruption.empty();
  std::string gaps = fmt::format("{}: not complete: {}", options_.folder, recorded.gaps);
  if (!is_stopped && watch_->end().replacement && options_.follows_servers) {
    lines_.push_back({true, std::move(gaps)});
  } else if (!is_stopped && (recorded.is_reset || watch_->end().is_reset)) {
    lines_.push_back({false, fmt::format("{}: run {} ended by a reset: {}", options_.folder,
                                         to_text(run_->parameters.run_id()), recorded.gaps)});
  } else {
    end(std::move(gaps));
    return;
  }
  phase_ = Phase::kFinding;
  patience_.reset();
}

RecorderCore::Act RecorderCore::end(std::string error) {
  phase_ = Phase::kEnded;
  error_ = std::move(error);
  return Act::kNone;
}

}  // namespace sls::record
