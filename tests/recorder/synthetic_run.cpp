#include "tests/recorder/synthetic_run.hpp"

#include <Eigen/Core>
#include <cmath>

#include "common/bus/convert.hpp"
#include "common/model/state.hpp"
#include "common/text/sha256.hpp"

namespace sls::record::test {
namespace {

constexpr std::int64_t kPeriod = 4'000'000;

std::uint64_t status_samples = 0;  // of the current run

double to_time(std::uint64_t step) { return static_cast<double>(step) * 0.004; }

/// A vector of three different functions of time with amplitude `scale`.
Eigen::Vector3d make_vector(std::uint64_t step, double phase, double scale) {
  const double t = to_time(step);
  return scale *
         Eigen::Vector3d(std::sin(t + phase), std::cos(2 * t + phase), std::sin(3 * t - phase));
}

Eigen::Vector3d make_force(std::uint64_t step) {
  return make_vector(step, 0.5, 3.0) - Eigen::Vector3d(0, 0, 16.66);
}

/// The controller's state after the answer to `step`.
ControllerState make_controller(std::uint64_t step) {
  ControllerState message;
  message.stage_index(step < 100 ? 0 : 1);
  message.stage_start_step(step < 100 ? 0 : 100);
  return message;
}

}  // namespace

const char* const kScenarioText = R"(# Bytes that must survive: tabs	and trailing spaces   
name: synthetic
vehicle: { quad_mass_kg: 1.5, load_mass_kg: 0.2, rod_length_m: 1.0, gravity_m_s2: 9.8 }
plant: { step_s: 0.001, initial: { load_position_m: [0, 0, -0.5] } }
sync: { mode: lockstep, period_s: 0.004, wait_for: { controllers: 1, recorders: 1, timeout_s: 30 } }
controller: { gains: { lqr: { horizontal: 10, vertical: 5 } }, force_limit_n: 200 }
mission:
  - hold: { position_m: [0, 0, -0.5] }
    for_s: 0.4
  - figure_eight: { amplitude_m: [1.5, 0.75, 0.5], offset_m: [0, 0, -0.5], period_s: 0.4 }
    for_s: 0.8
)";

void set_vehicles(Parameters& parameters, const std::vector<std::uint32_t>& ids) {
  parameters.vehicles().clear();
  for (const std::uint32_t id : ids) {
    VehicleParameters& vehicle = parameters.vehicles().emplace_back();
    vehicle.vehicle_id(id);
    vehicle.quad_mass_kg(1.5);
    vehicle.load_mass_kg(0.2);
    vehicle.rod_length_m(1.0);
    vehicle.gravity_m_s2(9.8);
  }
}

Parameters make_parameters() {
  status_samples = 0;
  Parameters message;
  message.run_id(kRunId);
  set_vehicles(message, {0});
  message.scenario_text(kScenarioText);
  message.scenario_sha256(text::calc_sha256(kScenarioText));
  message.contract_sha256(bus::kContractSha256);
  message.period_ns(kPeriod);
  message.step_ns(1'000'000);
  message.mode(SyncMode::MODE_LOCKSTEP);
  message.version("sls 0.0.test");
  return message;
}

Parameters make_signal_parameters() {
  Parameters message = make_parameters();
  message.has_attitude(true);
  message.signals().resize(2);
  message.signals()[0].name("tension_n");
  message.signals()[0].unit("N");
  message.signals()[1].name("wind");
  return message;
}

RecordEntry make_entry(std::uint64_t step, std::uint32_t vehicle_id) {
  model::RodAngles rod;
  rod.alpha = 0.3 * std::sin(to_time(step) + 1);
  rod.beta = 0.2 * std::cos(to_time(step) + 1);
  rod.alpha_dot = 0.31;
  rod.beta_dot = -0.21 - to_time(step);
  const auto state = model::make_state(make_vector(step, 1, 10), make_vector(step, 2, 5), rod, 1.0);
  RecordEntry entry;
  entry.vehicle_id(vehicle_id);
  entry.step(step);
  entry.kind(AnswerKind::ANSWER_ACCEPTED);
  PlantState& truth = entry.truth();
  truth.p_WQ_m(bus::to_array(state.p_WQ));
  truth.v_WQ_m_s(bus::to_array(state.v_WQ));
  truth.q_WB({std::cos(to_time(step)), std::sin(to_time(step)), 0, -0.0});
  truth.w_WB_B_rad_s(bus::to_array(make_vector(step, 8, 4)));
  truth.p_WL_m(bus::to_array(state.p_WL));
  truth.v_WL_m_s(bus::to_array(state.v_WL));
  truth.alpha_rad(rod.alpha);
  truth.beta_rad(rod.beta);
  truth.alpha_dot_rad_s(rod.alpha_dot);
  truth.beta_dot_rad_s(rod.beta_dot);
  truth.signals({0.1 + to_time(step), -7});
  if (step > 0) entry.f_Q_W_n(bus::to_array(make_force(step - 1)));
  entry.answered_step(step);
  entry.client_name(kPilot);
  ControlCommand& answer = entry.answer();
  answer.vehicle_id(vehicle_id);
  answer.f_Q_W_n(bus::to_array(make_force(step)));
  answer.controller(make_controller(step));
  answer.mission(step == kLastStep ? MissionPhase::MISSION_FINISHED
                                   : MissionPhase::MISSION_RUNNING);
  answer.fault(FaultCode::FAULT_NONE);
  answer.compute_time_ns(12345 + step);
  Reference& reference = answer.reference();
  reference.stage_index(step < 100 ? 0 : 1);
  reference.stage_name(step < 100 ? "hold" : "figure_eight");
  reference.position_m(bus::to_array(make_vector(step, 3, 9)));
  reference.velocity_m_s(bus::to_array(make_vector(step, 4, 8)));
  reference.acceleration_m_s2(bus::to_array(make_vector(step, 5, 7)));
  reference.jerk_m_s3(bus::to_array(make_vector(step, 6, 6)));
  reference.snap_m_s4(bus::to_array(make_vector(step, 7, 5)));
  return entry;
}

RecordEntry make_unanswered_entry(std::uint64_t step, AnswerKind kind) {
  RecordEntry entry = make_entry(step);
  entry.kind(kind);
  entry.answered_step(step - 1);
  entry.answer().f_Q_W_n(bus::to_array(make_force(step + 1000)));
  entry.answer().reference().position_m({1, 2, 3});  // of another step: must not be recorded
  return entry;
}

RecordEntry make_late_entry(std::uint64_t step, std::uint32_t vehicle_id) {
  RecordEntry entry = make_entry(step, vehicle_id);
  entry.kind(AnswerKind::ANSWER_LATE);
  entry.truth(PlantState());
  entry.f_Q_W_n({0, 0, 0});
  return entry;
}

RecordEntry make_bare_entry(std::uint64_t step) {
  RecordEntry entry = make_entry(step);
  entry.kind(AnswerKind::ANSWER_NONE);
  entry.client_name("");
  entry.answer(ControlCommand());
  return entry;
}

RecordBatch make_batch(std::uint64_t batch_index, const std::vector<RecordEntry>& entries,
                       bool is_last) {
  RecordBatch batch;
  batch.run_id(kRunId);
  batch.batch_index(batch_index);
  batch.is_last(is_last);
  batch.entries(entries);
  return batch;
}

SimStatus make_status(RunPhase phase, std::uint64_t step, const std::string& reason) {
  SimStatus message;
  message.run_id(kRunId);
  message.sample_index(status_samples++);
  message.phase(phase);
  message.reason(reason);
  message.step(step);
  message.controller_name(step > 0 || phase == RunPhase::PHASE_FINISHED ? kPilot : "");
  message.real_time_factor(1.5);
  message.round_trip_p50_ns(81'250);
  message.round_trip_p99_ns(140'000);
  message.timing("exact");
  message.counters().resent(11);
  message.counters().rejected_fault(12);
  return message;
}

}  // namespace sls::record::test
