#include "recorder/core/run_watch.hpp"

#include <spdlog/fmt/fmt.h>

#include <chrono>

#include "common/sync/invariant.hpp"

namespace sls::record {
namespace {

using namespace std::chrono_literals;

constexpr double kCompletionTime = 10;    // s, wait for each step after the end of a finished run
constexpr double kFailedTime = 1;         // s, wait after the end of any other run
constexpr double kInterruptionTime = .5;  // s, wait after a stop signal
constexpr auto kNewsTime = 20ms;          // least time between two announcements of new steps
constexpr std::int64_t kManySteps = 500;  // announced at once: the server may wait for it
constexpr auto kAnnounceTime = 500ms;     // longest time between two announcements

}  // namespace

RunWatch::RunWatch(const sync::Run& run, std::uint32_t vehicle, double server_deadline_s,
                   const Now& now)
    : run_(run),
      run_id_(run.parameters.run_id()),
      vehicle_(vehicle),
      server_deadline_s_(server_deadline_s),
      server_(run_id_, server_deadline_s, now.time),
      announced_step_(now.last_complete_step),
      announced_time_(now.time) {}

bool RunWatch::look(const sync::Servers& servers, const Now& now) {
  const auto status = servers.find_status(run_id_);
  if (!now.interruption.empty()) {
    end_.interruption = now.interruption;
    end_within(kInterruptionTime, now.time);
  } else if (status && status->phase() == RunPhase::PHASE_FINISHED) {
    end_within(kCompletionTime, now.time);
    if (now.last_complete_step > std::exchange(step_after_end_, now.last_complete_step))
      give_up_->renew(now.time);
  } else if (status && (status->phase() == RunPhase::PHASE_FAILED ||
                        status->phase() == RunPhase::PHASE_RESET)) {
    end_within(kFailedTime, now.time);
  } else if (!give_up_) {
    look_at_server(servers, now.time);
  }
  if (!give_up_) return false;
  if (give_up_->is_over(now.time)) return true;
  if (give_up_->is_report_due(now.time))
    lines_.push_back(
        {false, fmt::format("waiting for: samples after step {} of run {:016x} ({:.0f} s left)",
                            now.last_complete_step, run_id_, give_up_->seconds_left(now.time))});
  return false;
}

void RunWatch::look_at_server(const sync::Servers& servers, sync::Time now) {
  const auto finding = server_.look(servers.find_last_heard(run_id_), now);
  if (server_.report()) lines_.push_back(*server_.report());
  if (finding == sync::ServerWatch::Finding::kSilent) look_for_next_run(servers, now);
  if (finding != sync::ServerWatch::Finding::kLost) return;
  end_.outcome = "lost";
  end_.interruption =
      fmt::format("the {}, given up after {} s", server_.describe(now), server_deadline_s_);
  end_within(0, now);
}

/// Ends this run if another one replaces it: of the same server, or of a server that replaces it.
void RunWatch::look_for_next_run(const sync::Servers& servers, sync::Time now) {
  const auto next = servers.find_successor(run_, {vehicle_}, now);
  if (!next) return;
  end_.is_reset = next->server == run_.server;
  if (!end_.is_reset) end_.replacement = next;
  end_.outcome = end_.is_reset ? "reset" : "lost";
  end_.interruption =
      fmt::format("run {:016x} was replaced by run {:016x}", run_id_, next->parameters.run_id());
  lines_.push_back({true, end_.interruption});
  end_within(kFailedTime, now);
}

void RunWatch::end_within(double limit_s, sync::Time now) {
  if (!give_up_ || give_up_->seconds_left(now) > limit_s) give_up_.emplace(now, limit_s);
}

bool RunWatch::is_announcement_due(const Now& now) {
  const bool is_now_ready = !is_ready_ && now.hears_server;
  is_ready_ = is_ready_ || is_now_ready;
  const auto age = now.time - announced_time_;
  const std::int64_t news = now.last_complete_step - announced_step_;
  sync::keep(news >= 0, "the last complete step of a recording never goes back");
  const bool is_due =
      is_now_ready || age >= kAnnounceTime || news >= kManySteps || (news > 0 && age >= kNewsTime);
  if (!is_due) return false;
  announced_step_ = now.last_complete_step;
  announced_time_ = now.time;
  return true;
}

}  // namespace sls::record
