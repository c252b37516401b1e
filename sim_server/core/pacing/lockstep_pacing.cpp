#include "sim_server/core/pacing/lockstep_pacing.hpp"

#include <algorithm>
#include <chrono>
#include <utility>
#include <vector>

namespace sls::sim {
namespace {

using namespace std::chrono_literals;

}  // namespace

void LockstepPacing::published(const Moment& moment) {
  sent_ = last_sent_ = looked_ = moment.time;
  paused_ = {};
  resend_at_ = sent_ + timer_.timeout();
  look_at_ = resend_at_;
  is_late_ = false;
  if (!run_.fleet.is_anybody_absent()) return;
  // While steps are flown without answers, each waits one period for its answer.
  const config::Sync& sync = run_.scenario.sync;
  const auto period =
      sync::to_duration(static_cast<double>(sync.period_ns) * 1e-9 / sync.real_time_factor);
  look_at_ = std::min(resend_at_, sent_ + period);
}

bool LockstepPacing::close(sync::Time now) {
  const Fleet& fleet = run_.fleet;
  if (!fleet.are_all_accepted()) run_.absence.check_refusals(now);
  if (!fleet.are_all_accepted() && now >= look_at_) attend_to_silence(now);
  if (fleet.are_all_settled()) return true;
  if (!fleet.are_all_accepted()) return false;
  take_answered_step(now);
  return true;
}

void LockstepPacing::take_answered_step(sync::Time now) {
  timer_.answered(now - sent_, now - last_sent_);
  run_.report.series.round_trips.add(now - sent_);
  run_.fleet.take_answers();
  run_.absence.note_answers(now);
}

void LockstepPacing::attend_to_silence(sync::Time now) {
  if (!is_late_) take_over_at_ = sent_ + sync::to_duration(run_.scenario.sync.take_over_s);
  is_late_ = true;
  for (const auto& vehicle : run_.fleet.vehicles())
    if (!vehicle->gate.accepted()) vehicle->note_waiting(sent_);
  const bool is_paused = run_.control.holds();
  if (is_paused) {  // that does not count as absence, and nothing is flown without answers
    run_.report.series.note_rest(now - looked_);
    run_.note_rest(now - looked_);
    paused_ += now - looked_;
    take_over_at_ += now - looked_;
  }
  looked_ = now;
  if (now >= resend_at_) resend(now);
  if (!is_paused) {
    take_over_if_silent(now);
    if (!run_.fleet.are_all_accepted()) fly_without_answers(now);
  }
  const auto next_look = now + 1ms;
  look_at_ = std::min(
      resend_at_, run_.fleet.is_anybody_absent() ? next_look : std::max(take_over_at_, next_look));
}

void LockstepPacing::resend(sync::Time now) {
  run_.outputs.resend_states(run_.fleet, [this](std::size_t i) {
    return !run_.fleet.vehicles()[i]->gate.accepted().has_value();
  });
  ++run_.report.link.resent();
  timer_.resent();
  last_sent_ = now;
  resend_at_ = last_sent_ + timer_.timeout();
}

/// Settles the step unless, by the policy, a vehicle without an answer still waits for it.
void LockstepPacing::fly_without_answers(sync::Time now) {
  using Action = AbsenceAction;
  const double step_wait_s = sync::to_seconds(now - sent_ - paused_);
  std::vector<std::pair<Vehicle*, Action>> actions;
  for (const auto& vehicle : run_.fleet.vehicles())
    if (!vehicle->gate.accepted())
      actions.emplace_back(vehicle.get(), vehicle->decide(run_.scenario.sync, step_wait_s, now));
  const auto [least, most] =
      std::minmax_element(actions.begin(), actions.end(),
                          [](const auto& a, const auto& b) { return a.second < b.second; });
  const bool waits = least->second == Action::kWait && most->second != Action::kGiveUp;
  run_.absence.attend(waits ? Action::kWait : most->second, now);
  if (waits) return;
  for (const auto& [vehicle, action] : actions) vehicle->fly_without_answer(action);
  run_.fleet.take_answers();
  run_.absence.note_answers(now);
}

void LockstepPacing::take_over_if_silent(sync::Time now) {
  if (now < take_over_at_) return;
  bool is_anybody_passed_over = false;
  for (const auto& vehicle : run_.fleet.vehicles())
    is_anybody_passed_over = vehicle->gate.pass_over_silent_client() || is_anybody_passed_over;
  if (is_anybody_passed_over)
    take_over_at_ = now + sync::to_duration(run_.scenario.sync.take_over_s);
}

}  // namespace sls::sim
