#include "sim_server/lockstep_run.hpp"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <thread>

#include "common/app/run_main.hpp"

namespace sls::sim {
namespace {

using namespace std::chrono_literals;

std::chrono::steady_clock::duration to_duration(double seconds) {
  return std::chrono::duration_cast<std::chrono::steady_clock::duration>(
      std::chrono::duration<double>(seconds));
}

}  // namespace

std::optional<Run::Outcome> LockstepRun::exchange(const VehicleState& state) {
  using Action = ControllerAbsence::Action;
  const std::uint64_t step = state.step();
  gate_.expect(step);
  const auto sent = Clock::now();
  auto last_sent = sent;
  endpoints_.state_writer.write(state);
  auto resend_at = sent + timer_.timeout();
  // While steps are flown without answers, each is given a period.
  const auto period = to_duration(static_cast<double>(scenario_.sync.period_ns) * 1e-9 /
                                  scenario_.sync.real_time_factor);
  auto wake_at = absence_.is_acting() ? std::min(resend_at, sent + period) : resend_at;
  bool is_late = false;  // most answers come before the first resend
  while (!gate_.accepted()) {
    if (const auto received = endpoints_.commands.take(wake_at)) judge(*received);
    if (const auto refusal = gate_.refusal()) throw app::RunError(*refusal);
    const auto now = Clock::now();
    if (gate_.accepted() || now < wake_at) continue;

    if (!is_late) take_over_at_ = sent + to_duration(scenario_.sync.take_over_s);
    is_late = true;
    note_waiting(sent);
    if (now >= resend_at) {
      last_sent = Clock::now();
      endpoints_.state_writer.write(state);
      ++gate_.counters().resent();
      timer_.resent();
      resend_at = last_sent + timer_.timeout();
    }
    attend_now_and_then();
    if (attend_to_operator()) return std::nullopt;
    refresh_roster();
    take_over_if_silent(now);
    if (gate_.accepted()) break;
    const double step_wait_s = std::chrono::duration<double>(now - sent).count();
    const Action action = absence_.decide(step_wait_s, calc_absence_s());
    attend_to_absence(step, action);
    if (action != Action::kWait) return fly_without_answer(step, action);
    wake_at =
        std::min(resend_at, absence_.is_acting() ? now + 1ms : std::max(take_over_at_, now + 1ms));
  }
  const auto answered = Clock::now();
  timer_.answered(answered - sent, answered - last_sent);
  board_.round_trips.add(answered - sent);
  return take_accepted_answer();
}

void LockstepRun::take_over_if_silent(Clock::time_point now) {
  if (now < take_over_at_ || !gate_.pass_over_silent_client()) return;
  take_over_at_ = now + to_duration(scenario_.sync.take_over_s);
}

bool LockstepRun::wait_for_recorders(std::uint64_t step) {
  using config::RecorderPolicy;
  const auto& patience = scenario_.sync.wait.recorder;
  const auto find_blocking = [&] {
    return name_blocking_recorder(roster_, scenario_.sync.wait_for.recorders, step,
                                  recorder_window_);
  };
  refresh_roster_if_due();
  std::string blocking = find_blocking();
  if (blocking.empty() && are_recorders_given_up_) {
    are_recorders_given_up_ = false;
    board_.announce(fmt::format("step {}: the recorders are back", step));
  }
  if (are_recorders_given_up_) return true;
  std::optional<app::Wait> wait;
  bool is_reported = false;
  for (; !blocking.empty(); blocking = find_blocking()) {
    attend_now_and_then();
    if (attend_to_operator()) return false;
    if (!wait) wait.emplace(patience.deadline_s);
    if (wait->is_over()) {
      const std::string waited =
          fmt::format("step {}: waited {} s for {}", step, patience.deadline_s, blocking);
      if (patience.policy != RecorderPolicy::kGoOn) throw app::RunError(waited);
      board_.announce(waited + ": goes on without");
      are_recorders_given_up_ = true;
      return true;
    }
    if (wait->is_report_due()) {
      is_reported = true;
      board_.announce(fmt::format("step {}: waiting for: {} ({:.0f} s left)", step, blocking,
                                  wait->seconds_left()));
    }
    std::this_thread::sleep_for(1ms);
    refresh_roster();
  }
  if (is_reported) board_.announce(fmt::format("step {}: the recorders are back", step));
  return true;
}

}  // namespace sls::sim
