#include "sim_server/core/vehicle.hpp"

#include "common/bus/convert.hpp"
#include "sim_server/core/fail_safe.hpp"

namespace sls::sim {
namespace {

/// Without the text of the scenario: otherwise every vehicle would keep a copy of it.
config::Scenario make_own_scenario(const config::Scenario& fleet, std::uint32_t id) {
  config::Scenario scenario = config::make_vehicle_scenario(fleet, id);
  scenario.text.clear();
  return scenario;
}

double calc_elapsed_s(const std::optional<sync::Time>& since, sync::Time now) {
  return since ? sync::to_seconds(now - *since) : 0.0;
}

}  // namespace

Vehicle::Vehicle(const config::Scenario& fleet, std::uint32_t id, std::uint64_t run_id)
    : gate(run_id, id, make_answer_limits(fleet)),
      absence(fleet.sync),
      id_(id),
      scenario_(make_own_scenario(fleet, id)),
      faults_(scenario_, id) {}

void Vehicle::measure(std::uint64_t step, const model::Measurement& truth,
                      const model::Measurement* seen) {
  step_ = step;
  outcome_.reset();
  state_ = truth;
  measured_ = faults_.measure(step, seen ? *seen : truth);
  can_measured_differ_ = seen || faults_.can_disturb_state();
}

void Vehicle::take_answer() {
  const OfferedAnswer& answer = *gate.accepted();
  Outcome outcome;
  outcome.is_finished = answer.command.mission() == MissionPhase::MISSION_FINISHED;
  hold(answer);
  has_ended_late_ = false;
  outcome.applied = last_answer_;
  outcome_ = std::move(outcome);
}

void Vehicle::keep_late_answer(const OfferedAnswer& answer) {
  if (last_answer_.origin != ForceOrigin::FORCE_NONE && answer.step <= last_answer_step_) return;
  hold(answer);
  has_ended_late_ = answer.command.mission() == MissionPhase::MISSION_FINISHED;
}

void Vehicle::hold(const OfferedAnswer& answer) {
  last_answer_.answer_f_Q_W = bus::to_vector(answer.command.f_Q_W_n());
  last_answer_.origin = ForceOrigin::FORCE_ANSWERED;
  last_answer_.controller_name = answer.client_name;
  last_answer_.memory = answer.command.controller();
  last_answer_step_ = answer.step;
  last_command_ = answer.command;
  absence.answered();
  absent_since_.reset();
  refused_since_.reset();
}

void Vehicle::fly_without_answer(ControllerAbsence::Action action) {
  Outcome outcome;
  outcome.applied = last_answer_;
  if (action == ControllerAbsence::Action::kHold &&
      last_answer_.origin != ForceOrigin::FORCE_NONE) {
    outcome.applied.origin = ForceOrigin::FORCE_HELD;
  } else {  // also before the first answer, when there is nothing to hold
    outcome.applied.origin = ForceOrigin::FORCE_FAIL_SAFE;
    outcome.applied.controller_name = kFailSafeName;
    outcome.applied.answer_f_Q_W =
        calc_fail_safe_force(scenario_.vehicle, state_, scenario_.controller.force_limit_n);
  }
  absence.flown_without_answer();
  outcome_ = std::move(outcome);
}

Eigen::Vector3d Vehicle::actuate() {
  applied_ = outcome_->applied;
  applied_.f_Q_W = faults_.actuate(step_, applied_.answer_f_Q_W);
  return applied_.f_Q_W;
}

void Vehicle::fill_record(RecordEntry& entry) const {
  entry.vehicle_id(id_);
  entry.step(step_);
  bus::fill(entry.truth(), state_);
  entry.measured().resize(can_measured_differ_ ? 1 : 0);
  if (can_measured_differ_) bus::fill(entry.measured().front(), measured_);
  entry.f_Q_W_n(bus::to_array(applied_.f_Q_W));
  entry.answer(last_command_);
  entry.answered_step(last_answer_step_);
  if (outcome_) {
    const Applied& applied = outcome_->applied;
    entry.kind(applied.origin == ForceOrigin::FORCE_ANSWERED ? AnswerKind::ANSWER_ACCEPTED
               : applied.origin == ForceOrigin::FORCE_HELD   ? AnswerKind::ANSWER_HELD
                                                             : AnswerKind::ANSWER_FAIL_SAFE);
    entry.client_name(applied.controller_name);
    entry.answer().f_Q_W_n(bus::to_array(applied.answer_f_Q_W));
    return;
  }
  const auto& answer = gate.accepted() ? gate.accepted() : gate.refused();
  entry.kind(gate.accepted() ? AnswerKind::ANSWER_ACCEPTED
             : answer        ? AnswerKind::ANSWER_REFUSED
                             : AnswerKind::ANSWER_NONE);
  entry.answered_step(step_);
  entry.client_name(answer ? answer->client_name : std::string());
  entry.answer(answer ? answer->command : ControlCommand());
}

std::uint64_t Vehicle::calc_age() const {
  return outcome_ && outcome_->applied.origin == ForceOrigin::FORCE_ANSWERED
             ? 0
             : step_ - last_answer_step_;
}

double Vehicle::calc_absence_s(sync::Time now) const { return calc_elapsed_s(absent_since_, now); }

double Vehicle::calc_refused_s(sync::Time now) const { return calc_elapsed_s(refused_since_, now); }

void Vehicle::note_rest(sync::Duration rest) {
  for (auto* since : {&absent_since_, &refused_since_})
    if (*since) **since += rest;
}

}  // namespace sls::sim
