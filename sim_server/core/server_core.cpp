#include "sim_server/core/server_core.hpp"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <chrono>
#include <exception>
#include <stdexcept>
#include <utility>

#include "common/sync/invariant.hpp"
#include "sim_server/core/pacing/lockstep_pacing.hpp"
#include "sim_server/core/pacing/realtime_pacing.hpp"

namespace sls::sim {
namespace {

using namespace std::chrono_literals;

constexpr auto kLookInterval = 20ms;
constexpr auto kShortLookInterval = 5ms;  // before the flight, which can be shorter than this wait
constexpr auto kRecorderLookInterval = 1ms;

std::unique_ptr<Pacing> make_pacing(RunParts& parts) {
  if (parts.scenario.sync.mode == config::SyncMode::kRealtime)
    return std::make_unique<RealtimePacing>(parts);
  return std::make_unique<LockstepPacing>(parts);
}

bool may_fly_without_answers(const config::Sync& sync) {
  const auto policy = sync.wait.controller.policy;
  return sync.mode == config::SyncMode::kRealtime || policy == config::ControllerPolicy::kHold ||
         policy == config::ControllerPolicy::kFailsafe;
}

}  // namespace

ServerCore::ServerCore(const config::Scenario& scenario, const Start& start,
                       std::unique_ptr<Fleet> fleet, Outputs& outputs, sync::Time now)
    : parts_(scenario, start.run_id, start.begins_paused, std::move(fleet), outputs),
      preparation_(parts_, now),
      recorders_(scenario.sync, parts_.report),
      pacing_(make_pacing(parts_)) {
  if (start.claims) return;
  preparation_.start_gathering(now);
  phase_ = Phase::kGathering;
}

template <class Work>
void ServerCore::guard(sync::Time now, Work work) {
  try {
    work();
  } catch (const std::exception& error) {
    on_failure(error.what(), now);
  }
}

// --- events --------------------------------------------------------------------------------------

void ServerCore::on_commands(CommandSample& sample) {
  if (phase_ == Phase::kEnded) return;  // answers to states that no plant will use
  const sync::Time now = sample.arrived.time;
  guard(now, [&] {
    parts_.watch.note_arrival(sample);
    judge(sample);
    pacing_->received(sample);
    if (phase_ == Phase::kAwaitingAnswers) go_on(now);
  });
}

void ServerCore::judge(CommandSample& sample) {
  if (sample.answers.empty() && sample.run_id == parts_.run_id) {
    parts_.watch.answers().note_empty(sample.sender, sample.step);
    for (const auto& vehicle : parts_.fleet.vehicles())
      vehicle->gate.note_sign_of_life(sample.sender);
  }
  const bool is_published = phase_ == Phase::kAwaitingAnswers;
  for (OfferedAnswer& offered : sample.answers) {
    offered.is_early = !is_published || sample.arrived.time < published_;
    Vehicle* vehicle = parts_.fleet.find(offered.vehicle_id);
    // The gate of another vehicle refuses and counts it.
    if (!vehicle) vehicle = parts_.fleet.vehicles().front().get();
    note(vehicle->gate.offer(offered, sample.sender), *vehicle, offered, sample);
  }
}

void ServerCore::note(Verdict verdict, Vehicle& vehicle, const OfferedAnswer& offered,
                      const CommandSample& sample) {
  if (verdict == Verdict::kLate) {
    parts_.outputs.record_late(vehicle, offered);
    pacing_->note_late(vehicle, offered, sample.arrived.time);
  }
  AnswerCheck& check = parts_.watch.answers();
  if (*to_string(verdict) != '\0')
    return check.note_rejected(offered, sample.sender, verdict, parts_.fleet.step());
  check.note_taken(offered, sample.sender, verdict);
}

void ServerCore::on_request(const SimControl& request, const Surroundings& around, sync::Time now) {
  // It may be meant for another server of this domain.
  if (request.run_id() != parts_.run_id && around.is_known_elsewhere(request.run_id())) return;
  guard(now, [&] {
    const std::uint64_t events = parts_.control.events();
    if (const auto reply = parts_.control.request(request, parts_.fleet.step()))
      parts_.outputs.send(*reply);
    if (parts_.control.events() == events) return;
    parts_.outputs.log(
        {false, fmt::format("step {}: {}", parts_.fleet.step(), parts_.control.last_event())});
    // Before the claim is settled no participant has joined, so nothing is published.
    if (parts_.report.has_published()) {
      const bool waits = parts_.report.phase() == RunPhase::PHASE_WAITING;
      parts_.report.publish(waits                        ? RunPhase::PHASE_WAITING
                            : parts_.control.is_paused() ? RunPhase::PHASE_PAUSED
                                                         : RunPhase::PHASE_RUNNING,
                            parts_.control.last_event(), now);
    }
    if (parts_.control.is_stop_requested()) throw std::runtime_error(parts_.control.last_event());
    if (parts_.control.is_reset_requested())
      return end_run(End::kReset, RunPhase::PHASE_RESET, parts_.control.last_event(), now);
    if (is_between_steps()) go_on(now);
  });
}

void ServerCore::on_time(sync::Time now) {
  guard(now, [&] { go_on(now); });
}

void ServerCore::on_look(Surroundings& around, sync::Time now) {
  if (phase_ == Phase::kEnded) return;
  looked_ = now;
  guard(now, [&] {
    const std::string stop = around.stop_signal();
    if (!stop.empty()) throw std::runtime_error(stop);
    if (phase_ == Phase::kClaiming) {
      preparation_.claim(around, now);
      if (preparation_.is_claimed()) phase_ = Phase::kGathering;
      return;
    }
    keep_house(around, now);
    if (parts_.watch.refresh_if_due(around, phase_ == Phase::kAwaitingAnswers, now)) {
      recorders_.update(parts_.watch.roster(), around.queues().history_steps);
      pacing_->roster_changed(now);
    }
    recorders_.note_written(around.queues().written);
    pacing_->look(around);
    if (phase_ == Phase::kGathering && preparation_.gather(around, now)) return begin_flight(now);
    go_on(now);
  });
}

void ServerCore::on_failure(const std::string& reason, sync::Time now) {
  if (!error_.empty()) return;  // only the first failure counts
  error_ = reason;
  if (phase_ == Phase::kEnded && end_ == End::kFinished) return;
  end_run(End::kFailed, RunPhase::PHASE_FAILED, reason, now);
}

sync::Time ServerCore::next_deadline() const {
  const sync::Time look = looked_ + calc_look_interval();
  if (phase_ == Phase::kAwaitingDue) return std::min(look, pacing_->due());
  if (phase_ == Phase::kAwaitingAnswers) return std::min(look, pacing_->deadline());
  return look;
}

sync::Duration ServerCore::calc_look_interval() const {
  switch (phase_) {
    case Phase::kClaiming:
    case Phase::kGathering:
      return kShortLookInterval;
    case Phase::kAwaitingRecorders:
      return kRecorderLookInterval;
    default:
      return kLookInterval;
  }
}

// --- flight --------------------------------------------------------------------------------------

void ServerCore::begin_flight(sync::Time now) {
  parts_.report.series.begin(now);
  parts_.watch.begin(now);
  parts_.report.publish(
      parts_.control.is_paused() ? RunPhase::PHASE_PAUSED : RunPhase::PHASE_RUNNING,
      parts_.control.last_event(), now);
  parts_.outputs.begin_flight();
  pacing_->begin(now);
  parts_.fleet.begin();
  parts_.fleet.expect_answers();
  publish_if_allowed(now);
}

Leaving ServerCore::leave(sync::Time now) const {
  const bool may_lack = parts_.scenario.sync.wait.recorder.policy == config::RecorderPolicy::kGoOn;
  const bool has_failed = !error_.empty() && end_ != End::kFinished;
  return Leaving(has_failed ? 0 : recorders_.expected(), !may_lack, now);
}

bool ServerCore::is_between_steps() const {
  return phase_ == Phase::kResting || phase_ == Phase::kAwaitingRecorders ||
         phase_ == Phase::kAwaitingDue;
}

void ServerCore::go_on(sync::Time now) {
  if (is_between_steps()) return publish_if_allowed(now);
  if (phase_ == Phase::kAwaitingAnswers && pacing_->close(now)) finish_step(now);
}

/// Publishes the states of the step in work unless operator, recorders or schedule hold it.
void ServerCore::publish_if_allowed(sync::Time now) {
  if (parts_.control.holds()) {
    if (phase_ == Phase::kResting) return;
    end_rest(now);
    phase_ = Phase::kResting;
    rest_began_ = now;
    return parts_.outputs.flush_records();
  }
  if (phase_ == Phase::kResting) end_rest(now);
  if (!recorders_.allows(parts_.watch.roster(), parts_.fleet.step(),
                         parts_.outputs.is_record_full(), now)) {
    if (phase_ != Phase::kAwaitingRecorders) rest_began_ = now;
    phase_ = Phase::kAwaitingRecorders;
    return;
  }
  end_rest(now);
  phase_ = Phase::kAwaitingDue;
  if (now < pacing_->due()) return;
  sync::keep(preparation_.is_claimed(), "no state leaves before the claim is settled");
  phase_ = Phase::kAwaitingAnswers;
  const Moment moment = parts_.outputs.send_states(parts_.fleet);
  published_ = moment.time;
  pacing_->published(moment);
}

/// While the run rests between two steps, nobody is waited for but an operator or recorders.
void ServerCore::end_rest(sync::Time now) {
  const sync::Duration rest = now - rest_began_;
  if (phase_ == Phase::kResting) {
    parts_.report.series.note_rest(rest);
    recorders_.note_rest(rest);
    pacing_->note_rest(rest);
  }
  if (phase_ == Phase::kResting || phase_ == Phase::kAwaitingRecorders) parts_.note_rest(rest);
  phase_ = Phase::kAwaitingDue;
}

void ServerCore::finish_step(sync::Time now) {
  if (parts_.fleet.is_finished())
    return end_run(End::kFinished, RunPhase::PHASE_FINISHED, "mission finished", now);
  parts_.outputs.record_step(parts_.fleet);
  const config::Sync& sync = parts_.scenario.sync;
  for (const auto& vehicle : parts_.fleet.vehicles()) {
    const model::AnswerKind kind = vehicle->record().kind;
    const bool is_held = kind == model::AnswerKind::kHeld || kind == model::AnswerKind::kFailSafe;
    sync::keep(kind == model::AnswerKind::kAccepted || (is_held && may_fly_without_answers(sync)),
               "each step is flown with an answer, unless the policy is hold or failsafe");
    parts_.report.series.timing.add(kind, vehicle->calc_age());
  }
  phase_ = Phase::kAwaitingDue;  // its states are recorded: no second time, should a plant fail
  parts_.fleet.advance();
  parts_.announce_remarks(now);
  parts_.fleet.expect_answers();
  if (const auto reply = parts_.control.stepped(parts_.fleet.step())) parts_.outputs.send(*reply);
  publish_if_allowed(now);
}

void ServerCore::keep_house(Surroundings& around, sync::Time now) {
  if (!parts_.report.series.is_due(now) && !parts_.watch.is_look_due(around, now)) return;
  const std::string problem = parts_.report.problem;
  parts_.watch.look(around, now);
  if (!parts_.report.series.is_due(now) && parts_.report.problem == problem) return;
  parts_.report.publish(parts_.control.is_paused() ? parts_.control.last_event() : "", now);
  preparation_.check_claim(around);
  parts_.watch.report_silent_recorder(now);
}

void ServerCore::end_run(End end, RunPhase phase, const std::string& reason, sync::Time now) {
  const bool is_step_published = std::exchange(phase_, Phase::kEnded) == Phase::kAwaitingAnswers;
  end_ = end;
  if (const auto reply = parts_.control.end(parts_.fleet.step(), reason))
    parts_.outputs.send(*reply);
  // Before the claim is settled no participant has joined, so nothing is published.
  if (!parts_.report.has_published()) return;
  if (is_step_published) {
    for (const auto& vehicle : parts_.fleet.vehicles()) vehicle->complete_record();
    parts_.outputs.record_step(parts_.fleet);
  }
  parts_.outputs.end_records();
  parts_.announce_remarks(now);  // of a step that failed
  parts_.report.publish(phase, reason, now);
  if (end == End::kFinished) parts_.outputs.log({false, parts_.report.describe_end(now)});
}

}  // namespace sls::sim
