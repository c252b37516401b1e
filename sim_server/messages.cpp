#include "sim_server/messages.hpp"

#include <random>

#include "common/bus/convert.hpp"

namespace sls::sim {

namespace {

/// The fields that VehicleState (measured) and PlantState (true) share.
template <class Message>
void fill(Message& message, const model::SlungLoadState& state) {
  message.p_WQ_m(bus::to_array(state.p_WQ));
  message.v_WQ_m_s(bus::to_array(state.v_WQ));
  message.p_WL_m(bus::to_array(state.p_WL));
  message.v_WL_m_s(bus::to_array(state.v_WL));
  message.alpha_rad(state.rod.alpha);
  message.beta_rad(state.rod.beta);
  message.alpha_dot_rad_s(state.rod.alpha_dot);
  message.beta_dot_rad_s(state.rod.beta_dot);
}

}  // namespace

std::uint64_t make_run_id() {
  std::random_device random;
  std::uint64_t id = 0;
  while (id == 0) id = (static_cast<std::uint64_t>(random()) << 32) | random();
  return id;
}

VehicleState make_state_message(std::uint64_t run_id, std::uint32_t vehicle_id, std::uint64_t step,
                                std::int64_t period_ns, const model::SlungLoadState& measured,
                                const model::SlungLoadState& truth, const Applied& applied) {
  VehicleState message;
  message.run_id(run_id);
  message.vehicle_id(vehicle_id);
  message.step(step);
  message.sim_time_ns(static_cast<std::int64_t>(step) * period_ns);
  fill(message, measured);
  fill(message.truth(), truth);
  message.f_Q_W_n(bus::to_array(applied.f_Q_W));
  message.force_origin(applied.origin);
  message.controller_name(applied.controller_name);
  message.controller(applied.memory);
  message.answer_f_Q_W_n(bus::to_array(applied.answer_f_Q_W));
  return message;
}

Parameters make_parameters_message(std::uint64_t run_id,
                                   const std::vector<std::uint32_t>& vehicle_ids,
                                   const config::Scenario& scenario, const std::string& version) {
  Parameters message;
  message.run_id(run_id);
  message.vehicle_id(vehicle_ids.front());
  message.vehicle_ids(vehicle_ids);
  message.scenario_sha256(scenario.sha256);
  message.scenario_text(scenario.text);
  message.quad_mass_kg(scenario.vehicle.quad_mass);
  message.load_mass_kg(scenario.vehicle.load_mass);
  message.rod_length_m(scenario.vehicle.rod_length);
  message.gravity_m_s2(scenario.vehicle.gravity);
  message.period_ns(scenario.sync.period_ns);
  message.step_ns(scenario.plant.step_ns);
  const bool lockstep = scenario.sync.mode == config::SyncMode::kLockstep;
  message.mode(lockstep ? MODE_LOCKSTEP : MODE_REALTIME);
  message.real_time_factor(lockstep ? 0.0 : scenario.sync.real_time_factor);
  message.version(version);
  return message;
}

}  // namespace sls::sim
