#include "sim_server/core/participants/recorder_wait.hpp"

#include <spdlog/fmt/fmt.h>

#include <stdexcept>
#include <utility>

namespace sls::sim {

void RecorderWait::update(const Roster& roster, std::uint64_t history_steps) {
  window_ = calc_recorder_window(history_steps);
  limit_ = calc_recorder_limit(roster, sync_.wait_for.recorders, window_);
}

bool RecorderWait::allows(const Roster& roster, std::uint64_t step, bool is_full, sync::Time now) {
  const bool is_realtime = sync_.mode == config::SyncMode::kRealtime;
  if (step < limit_ && (!is_full || is_realtime) && full_.is_idle() && behind_.is_idle())
    return true;  // no texts on the fast path
  const std::string blocking =
      name_blocking_recorder(roster, sync_.wait_for.recorders, step, window_);
  if (is_realtime) {
    attend_in_real_time(blocking, step, now);
    return true;
  }
  return passes(full_, is_full ? "recorder: the queue of sls/record is full" : "", step, now) &&
         passes(behind_, blocking, step, now);
}

bool RecorderWait::passes(Wait& wait, const std::string& cause, std::uint64_t step,
                          sync::Time now) {
  const auto& policy = sync_.wait.recorder;
  if (cause.empty()) {
    const bool is_back = wait.is_given_up || wait.is_reported;
    wait = Wait();
    if (is_back) report_.announce(fmt::format("step {}: the recorders are back", step), now);
    return true;
  }
  if (wait.is_given_up) return true;
  if (!wait.patience) {
    wait.patience.emplace(now, policy.deadline_s);
    wait.written = written_;
  }
  if (std::exchange(wait.written, written_) != written_) wait.patience->renew(now);
  if (wait.patience->is_over(now)) {
    const std::string waited =
        fmt::format("step {}: waited {} s for {}", step, policy.deadline_s, cause);
    if (policy.policy != config::RecorderPolicy::kGoOn) throw std::runtime_error(waited);
    wait = Wait();
    wait.is_given_up = true;
    report_.announce(waited + ": continues without it", now);
    return true;
  }
  if (wait.patience->is_report_due(now)) {
    wait.is_reported = true;
    report_.announce(fmt::format("step {}: waiting for: {} ({:.0f} s left)", step, cause,
                                 wait.patience->seconds_left(now)),
                     now);
  }
  return false;
}

/// A flight in real time does not wait for recorders; only the policy `stop` ends it.
void RecorderWait::attend_in_real_time(const std::string& blocking, std::uint64_t step,
                                       sync::Time now) {
  const auto& policy = sync_.wait.recorder;
  if (blocking.empty()) return behind_.patience.reset();
  if (!behind_.patience) behind_.patience.emplace(now, policy.deadline_s);
  if (policy.policy == config::RecorderPolicy::kStop && behind_.patience->is_over(now))
    throw std::runtime_error(
        fmt::format("step {}: waited {} s for {}", step, policy.deadline_s, blocking));
  if (behind_.patience->is_report_due(now))
    report_.announce(fmt::format("step {}: continues without: {}", step, blocking), now);
}

}  // namespace sls::sim
