#include "sim_server/core/step/vehicle.hpp"

namespace sls::sim {
namespace {

using model::AnswerKind;

double calc_elapsed_s(const std::optional<sync::Time>& since, sync::Time now) {
  return since ? sync::to_seconds(now - *since) : 0.0;
}

}  // namespace

Eigen::Vector3d calc_fail_safe_force(const model::SlungLoadParameters& vehicle,
                                     const model::SlungLoadState& state, double force_limit) {
  constexpr double kTimeConstant = 1.0;  // s
  const double mass = vehicle.quad_mass + vehicle.load_mass;
  const Eigen::Vector3d f_Q_W =
      -mass * (vehicle.gravity * Eigen::Vector3d::UnitZ() + state.v_WQ / kTimeConstant);
  const double norm = f_Q_W.norm();
  return norm > force_limit ? Eigen::Vector3d(f_Q_W * (force_limit / norm)) : f_Q_W;
}

Vehicle::Vehicle(const config::Scenario& fleet, std::uint64_t run_id, model::StepRecord& record)
    : gate(run_id, record.vehicle_id, make_answer_limits(fleet)),
      parameters_(config::make_vehicle_scenario(fleet, record.vehicle_id).vehicle),
      force_limit_n_(fleet.controller.force_limit_n),
      record_(record) {}

void Vehicle::take_answer() {
  hold(*gate.accepted());
  has_ended_late_ = false;
  settle(AnswerKind::kAccepted);
}

void Vehicle::keep_late_answer(const OfferedAnswer& offered) {
  if (has_held_ && offered.step <= held_.step) return;
  hold(offered);
  has_ended_late_ = offered.answer.mission == model::MissionPhase::kFinished;
}

void Vehicle::hold(const OfferedAnswer& offered) {
  held_ = offered;
  has_held_ = true;
  steps_without_answer_ = 0;
  absent_since_.reset();
  refused_since_.reset();
}

void Vehicle::fly_without_answer(AbsenceAction action) {
  // Before the first answer there is nothing to hold.
  if (action == AbsenceAction::kHold && has_held_) {
    settle(AnswerKind::kHeld);
  } else {
    settle(AnswerKind::kFailSafe);
    record_.client_name = flown_by_ = kFailSafeName;
    record_.answer.f_Q_W = calc_fail_safe_force(parameters_, record_.truth, force_limit_n_);
  }
  ++steps_without_answer_;
}

void Vehicle::settle(AnswerKind kind) {
  record_.kind = kind;
  record_.answered_step = held_.step;
  record_.client_name = flown_by_ = held_.client_name;
  record_.answer = held_.answer;
  is_settled_ = true;
}

void Vehicle::complete_record() {
  if (is_settled_) return;
  const auto& offered = gate.accepted() ? gate.accepted() : gate.refused();
  record_.kind = gate.accepted() ? AnswerKind::kAccepted
                 : offered       ? AnswerKind::kRefused
                                 : AnswerKind::kNone;
  record_.answered_step = record_.step;
  const OfferedAnswer known = offered.value_or(OfferedAnswer());
  record_.client_name = known.client_name;
  record_.answer = known.answer;
}

bool Vehicle::is_finished() const {
  return record_.kind == AnswerKind::kAccepted &&
         record_.answer.mission == model::MissionPhase::kFinished;
}

AbsenceAction Vehicle::decide(const config::Sync& rules, double step_wait_s, sync::Time now) const {
  using config::ControllerPolicy;
  if (calc_absence_s(now) >= rules.calc_controller_patience_s()) return AbsenceAction::kGiveUp;
  const auto& absence = rules.wait.controller;
  const double period_s = static_cast<double>(rules.period_ns) * 1e-9;
  if (rules.mode != config::SyncMode::kRealtime) {
    if (absence.policy == ControllerPolicy::kWait || absence.policy == ControllerPolicy::kStop)
      return AbsenceAction::kWait;
    // The first step waits for the deadline, each later one for one period. Simulated time then
    // passes no faster than in real time, so a client can return.
    if (step_wait_s < (is_absent() ? period_s / rules.real_time_factor : absence.deadline_s))
      return AbsenceAction::kWait;
    if (absence.policy == ControllerPolicy::kFailsafe) return AbsenceAction::kFailSafe;
  }
  const double held_s = static_cast<double>(steps_without_answer_) * rules.period_ns * 1e-9;
  return held_s < rules.max_hold_s ? AbsenceAction::kHold : AbsenceAction::kFailSafe;
}

double Vehicle::calc_absence_s(sync::Time now) const { return calc_elapsed_s(absent_since_, now); }

double Vehicle::calc_refused_s(sync::Time now) const { return calc_elapsed_s(refused_since_, now); }

void Vehicle::note_rest(sync::Duration rest) {
  for (auto* since : {&absent_since_, &refused_since_})
    if (*since) **since += rest;
}

model::StepRecord make_late_record(const Vehicle& vehicle, const OfferedAnswer& offered) {
  model::StepRecord record;
  record.vehicle_id = vehicle.id();
  record.step = record.answered_step = offered.step;
  record.kind = model::AnswerKind::kLate;
  record.client_name = offered.client_name;
  record.answer = offered.answer;
  return record;
}

}  // namespace sls::sim
