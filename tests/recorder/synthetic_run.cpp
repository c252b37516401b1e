#include "tests/recorder/synthetic_run.hpp"

#include <Eigen/Core>
#include <cmath>

#include "common/bus/convert.hpp"
#include "common/config/sha256.hpp"
#include "common/model/state.hpp"

namespace sls::record::test {
namespace {

constexpr std::int64_t kPeriod = 4'000'000;

std::uint64_t status_samples = 0;  // of the run in work

double to_time(std::uint64_t step) { return static_cast<double>(step) * 0.004; }

/// Three different functions of time, of the size `scale`.
Eigen::Vector3d make_vector(std::uint64_t step, double phase, double scale) {
  const double t = to_time(step);
  return scale *
         Eigen::Vector3d(std::sin(t + phase), std::cos(2 * t + phase), std::sin(3 * t - phase));
}

Eigen::Vector3d make_force(std::uint64_t step) {
  return make_vector(step, 0.5, 3.0) - Eigen::Vector3d(0, 0, 16.66);
}

/// As the answer to `step` leaves it.
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

Parameters make_parameters() {
  status_samples = 0;
  Parameters message;
  message.run_id(kRunId);
  message.vehicle_id(0);
  message.vehicle_ids({0});
  message.scenario_text(kScenarioText);
  message.scenario_sha256(config::calc_sha256(kScenarioText));
  message.quad_mass_kg(1.5);
  message.load_mass_kg(0.2);
  message.rod_length_m(1.0);
  message.gravity_m_s2(9.8);
  message.period_ns(kPeriod);
  message.step_ns(1'000'000);
  message.mode(MODE_LOCKSTEP);
  message.version("sls 0.0.test");
  return message;
}

VehicleState make_state(std::uint64_t step) {
  model::RodAngles rod;
  rod.alpha = 0.3 * std::sin(to_time(step) + 1);
  rod.beta = 0.2 * std::cos(to_time(step) + 1);
  rod.alpha_dot = 0.31;
  rod.beta_dot = -0.21 - to_time(step);
  const auto state = model::make_state(make_vector(step, 1, 10), make_vector(step, 2, 5), rod, 1.0);
  VehicleState message;
  message.run_id(kRunId);
  message.step(step);
  message.sim_time_ns(static_cast<std::int64_t>(step) * kPeriod);
  PlantState& truth = message.truth();
  truth.p_WQ_m(bus::to_array(state.p_WQ));
  truth.v_WQ_m_s(bus::to_array(state.v_WQ));
  truth.p_WL_m(bus::to_array(state.p_WL));
  truth.v_WL_m_s(bus::to_array(state.v_WL));
  truth.alpha_rad(rod.alpha);
  truth.beta_rad(rod.beta);
  truth.alpha_dot_rad_s(rod.alpha_dot);
  truth.beta_dot_rad_s(rod.beta_dot);
  const Eigen::Vector3d bias(0.1, 0.2, 0.3);  // what is measured is not what is recorded
  message.p_WQ_m(bus::to_array(state.p_WQ + bias));
  message.v_WQ_m_s(bus::to_array(state.v_WQ + bias));
  message.p_WL_m(bus::to_array(state.p_WL + bias));
  message.v_WL_m_s(bus::to_array(state.v_WL + bias));
  message.alpha_rad(rod.alpha + 0.1);
  message.beta_rad(rod.beta + 0.1);
  message.alpha_dot_rad_s(rod.alpha_dot + 0.1);
  message.beta_dot_rad_s(rod.beta_dot + 0.1);
  if (step > 0) {
    message.f_Q_W_n(bus::to_array(make_force(step - 1)));
    message.answer_f_Q_W_n(message.f_Q_W_n());
    message.force_origin(FORCE_ANSWERED);
    message.controller_name(kPilot);
    message.controller(make_controller(step - 1));
  }
  return message;
}

ControlCommand make_command(std::uint64_t step) {
  ControlCommand message;
  message.run_id(kRunId);
  message.step(step);
  message.f_Q_W_n(bus::to_array(make_force(step)));
  message.client_name(kPilot);
  message.strength(5);
  message.controller(make_controller(step));
  message.mission(step == kLastStep ? MISSION_FINISHED : MISSION_RUNNING);
  message.fault(FAULT_NONE);
  message.compute_time_ns(12345 + step);
  return message;
}

Reference make_reference(std::uint64_t step) {
  Reference message;
  message.run_id(kRunId);
  message.step(step);
  message.sim_time_ns(static_cast<std::int64_t>(step) * kPeriod);
  message.client_name(kPilot);
  message.stage_index(step < 100 ? 0 : 1);
  message.stage_name(step < 100 ? "hold" : "figure_eight");
  message.position_m(bus::to_array(make_vector(step, 3, 9)));
  message.velocity_m_s(bus::to_array(make_vector(step, 4, 8)));
  message.acceleration_m_s2(bus::to_array(make_vector(step, 5, 7)));
  message.jerk_m_s3(bus::to_array(make_vector(step, 6, 6)));
  message.snap_m_s4(bus::to_array(make_vector(step, 7, 5)));
  return message;
}

VehicleState make_unanswered_state(std::uint64_t step, ForceOrigin origin) {
  VehicleState message = make_state(step);
  message.force_origin(origin);
  message.answer_f_Q_W_n(bus::to_array(make_force(step + 1000)));
  message.f_Q_W_n(bus::to_array(make_force(step + 2000)));
  return message;
}

ControlCommand make_standby_command(std::uint64_t step) {
  ControlCommand message = make_command(step);
  message.client_name("standby");
  message.strength(1);
  message.f_Q_W_n()[0] += 1.0;
  return message;
}

Reference make_standby_reference(std::uint64_t step) {
  Reference message = make_reference(step);
  message.client_name("standby");
  message.position_m()[0] += 1.0;
  return message;
}

SimStatus make_status(RunPhase phase, std::uint64_t step, const std::string& reason) {
  SimStatus message;
  message.run_id(kRunId);
  message.sample_index(status_samples++);
  message.phase(phase);
  message.reason(reason);
  message.step(step);
  message.controller_name(step > 0 || phase == PHASE_FINISHED ? kPilot : "");
  message.real_time_factor(1.5);
  message.round_trip_p50_ns(81'250);
  message.round_trip_p99_ns(140'000);
  message.timing("exact");
  message.counters().resent(11);
  message.counters().rejected_fault(12);
  return message;
}

}  // namespace sls::record::test
