#include "sim_server/core/pacing/realtime_pacing.hpp"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <stdexcept>
#include <utility>

#include "common/config/numbers.hpp"

namespace sls::sim {
namespace {

using namespace std::chrono_literals;

/// Periods in a row without an answer after which the next client's answer is used.
constexpr int kMissesBeforeTakeOver = 3;

constexpr int kLastAttempts = 20;
constexpr auto kLastAttemptTime = 50ms;

constexpr auto kProgressInterval = 5s;

std::chrono::duration<double, std::nano> calc_wall_period(const config::Sync& sync) {
  return std::chrono::duration<double, std::nano>(static_cast<double>(sync.period_ns) /
                                                  sync.real_time_factor);
}

}  // namespace

RealtimePacing::RealtimePacing(RunParts& run)
    : run_(run),
      schedule_({}, calc_wall_period(run.scenario.sync)),
      slow_answers_(
          std::chrono::duration_cast<sync::Duration>(calc_wall_period(run.scenario.sync))) {}

void RealtimePacing::begin(sync::Time now) {
  schedule_ = Schedule(now, calc_wall_period(run_.scenario.sync));
  missed_deadlines_.reset();
  next_progress_ = now + kProgressInterval;
}

void RealtimePacing::published(const Moment& moment) {
  const std::uint64_t step = run_.fleet.step();
  // The schedule is of awake time, so a stop of this program moves it.
  const sync::Duration stopped = moment.stopped - std::exchange(stopped_, moment.stopped);
  const auto lost = schedule_.slip(step, moment.time).value_or(sync::Duration(0)) + stopped;
  if (lost > sync::Duration(0)) run_.report.series.timing.add_slip(sync::to_seconds(lost));
  run_.report.series.timing.add_delay(sync::to_seconds(moment.time - schedule_.due(step)));
  published_ = moment.time;
  close_at_ = schedule_.close(step, published_);
  clocks_.published(step, moment.wall);
  show_progress(moment.time);
}

bool RealtimePacing::close(sync::Time now) {
  if (run_.fleet.are_all_accepted()) {
    run_.report.series.round_trips.add(now - published_);
  } else {
    run_.absence.check_refusals(now);
    if (now < close_at_ || wait_for_last_answers(now)) return false;
    pass_over_silent_clients(now);
  }
  run_.report.series.timing.set_overflow(run_.outputs.lost());
  run_.fleet.take_answers();
  run_.absence.note_answers(now);
  fly_without_answers(now);
  return true;
}

bool RealtimePacing::is_ending() const {
  const auto& vehicles = run_.fleet.vehicles();
  return std::all_of(vehicles.begin(), vehicles.end(), [](const auto& vehicle) {
    const auto& accepted = vehicle->gate.accepted();
    return accepted ? accepted->answer.mission == model::MissionPhase::kFinished
                    : vehicle->has_ended_late();
  });
}

bool RealtimePacing::wait_for_last_answers(sync::Time now) {
  if (!is_ending()) {
    last_attempts_ = 0;  // a late end may have been withdrawn
    return false;
  }
  if (last_attempts_ == kLastAttempts)
    throw std::runtime_error(
        fmt::format("step {}: the mission was finished, but {} does not answer", run_.fleet.step(),
                    run_.watch.name_awaited_controllers()));
  if (last_attempts_++ == 0) {
    ignore_lifespan_if_needed();
  } else {
    ++run_.report.link.resent();
    run_.outputs.resend_states(run_.fleet, [](std::size_t) { return true; });
  }
  close_at_ = now + kLastAttemptTime;
  return true;
}

void RealtimePacing::pass_over_silent_clients(sync::Time now) {
  for (const auto& vehicle : run_.fleet.vehicles()) {
    if (vehicle->gate.accepted()) continue;
    vehicle->note_waiting(published_);
    const bool is_silent = vehicle->gate.count_miss() >= kMissesBeforeTakeOver ||
                           vehicle->calc_absence_s(now) >= run_.scenario.sync.take_over_s;
    if (is_silent) vehicle->gate.pass_over_silent_client();
  }
}

void RealtimePacing::fly_without_answers(sync::Time now) {
  using Action = AbsenceAction;
  Action most = Action::kWait;
  for (const auto& vehicle : run_.fleet.vehicles()) {
    if (vehicle->is_settled()) continue;
    const Action action = vehicle->decide(run_.scenario.sync, 0.0, now);
    most = std::max(most, action);
    if (action != Action::kGiveUp) vehicle->fly_without_answer(action);
  }
  if (most != Action::kWait) run_.absence.attend(most, now);
}

void RealtimePacing::received(const CommandSample& sample) {
  if (sample.run_id != run_.run_id) return;
  const std::uint64_t step = run_.fleet.step();
  clocks_.note(sample, step);
  const auto& ready = run_.watch.roster().controllers;
  if (std::none_of(ready.begin(), ready.end(),
                   [&](const sync::Member& client) { return client.peer == sample.sender; }))
    return;
  const std::string slow = slow_answers_.note(sample, step);
  if (!slow.empty()) run_.report.announce(slow, sample.arrived.time);
}

void RealtimePacing::note_late(Vehicle& vehicle, const OfferedAnswer& answer, sync::Time now) {
  if (lifespan_ && now - schedule_.due(answer.step) > *lifespan_)
    ++run_.report.link.stale();
  else
    vehicle.keep_late_answer(answer);
}

void RealtimePacing::roster_changed(sync::Time now) {
  if (!lifespan_) return;
  for (const std::string& news : clocks_.look(run_.watch.roster().controllers, *lifespan_, now))
    run_.report.announce(news, now);
  ignore_lifespan_if_needed();
}

/// A wrong clock makes answers expire. The last one must not, however late it is.
void RealtimePacing::ignore_lifespan_if_needed() {
  const bool is_needed = lifespan_ && (clocks_.is_any_wrong() || last_attempts_ > 0);
  if (is_needed != std::exchange(is_lifespan_ignored_, is_needed))
    run_.outputs.ignore_lifespan(is_lifespan_ignored_);
}

void RealtimePacing::look(const Surroundings& around) {
  lifespan_ = around.command_lifespan();
  const std::uint64_t missed = around.queues().missed_deadlines;
  // While the run rests no command is due.
  if (missed_deadlines_ && !run_.control.holds())
    run_.report.link.deadline_missed() += missed - *missed_deadlines_;
  missed_deadlines_ = missed;
}

void RealtimePacing::note_rest(sync::Duration rest) {
  schedule_.pause(rest);
  missed_deadlines_.reset();
}

void RealtimePacing::show_progress(sync::Time now) {
  if (now < next_progress_) return;
  next_progress_ = now + kProgressInterval;
  const std::uint64_t step = run_.fleet.step();
  const auto period_ns = run_.scenario.sync.period_ns;
  run_.outputs.show_progress(
      fmt::format("step {}: {:.0f} s of simulated time, {}", step,
                  config::to_seconds(static_cast<std::int64_t>(step) * period_ns),
                  run_.report.series.timing.label()));
}

}  // namespace sls::sim
