#include "recorder/rows.hpp"

#include <limits>

#include "common/bus/convert.hpp"
#include "common/model/forces.hpp"

namespace sls::record {
namespace {

double calc_time(std::uint64_t step, const Parameters& parameters) {
  return static_cast<double>(static_cast<std::int64_t>(step) * parameters.period_ns()) / 1e9;
}

StateRow make_state_row(const RecordEntry& entry, const PlantState& state,
                        const Parameters& parameters) {
  StateRow row;
  row.vehicle_id = entry.vehicle_id();
  row.step = entry.step();
  row.sim_time_s = calc_time(entry.step(), parameters);
  row.p_WQ = state.p_WQ_m();
  row.v_WQ = state.v_WQ_m_s();
  row.p_WL = state.p_WL_m();
  row.v_WL = state.v_WL_m_s();
  row.alpha = state.alpha_rad();
  row.beta = state.beta_rad();
  row.alpha_dot = state.alpha_dot_rad_s();
  row.beta_dot = state.beta_dot_rad_s();
  row.f_Q_W = entry.f_Q_W_n();
  if (parameters.has_attitude()) {
    row.further.assign(state.q_WB().begin(), state.q_WB().end());
    row.further.insert(row.further.end(), state.w_WB_B_rad_s().begin(), state.w_WB_B_rad_s().end());
  }
  // Rows have as many fields as the header, whatever came.
  for (std::size_t i = 0; i < parameters.signals().size(); ++i)
    row.further.push_back(i < state.signals().size() ? state.signals()[i]
                                                     : std::numeric_limits<double>::quiet_NaN());
  return row;
}

CommandRow make_command_row(const RecordEntry& entry) {
  const ControlCommand& answer = entry.answer();
  CommandRow row;
  row.vehicle_id = entry.vehicle_id();
  row.step = entry.step();
  row.controller = entry.client_name().c_str();
  row.f_Q_W = answer.f_Q_W_n();
  if (entry.kind() == ANSWER_HELD)
    row.fault = CommandRow::kHeld;
  else if (entry.kind() == ANSWER_FAIL_SAFE)
    row.fault = CommandRow::kFailSafe;
  else
    row.fault = bus::to_string(answer.fault());
  if (!row.is_unanswered()) row.compute_us = static_cast<double>(answer.compute_time_ns()) / 1e3;
  return row;
}

}  // namespace

StepRows make_rows(const RecordEntry& entry, const Parameters& parameters) {
  StepRows rows;
  rows.vehicle_id = entry.vehicle_id();
  rows.step = entry.step();
  rows.state = make_state_row(entry, entry.truth(), parameters);
  if (!entry.measured().empty())
    rows.measured = make_state_row(entry, entry.measured().front(), parameters);
  if (entry.kind() != ANSWER_NONE) rows.command = make_command_row(entry);
  if (rows.command && !rows.command->is_unanswered()) add_reference(rows, entry, parameters);
  return rows;
}

void add_reference(StepRows& rows, const RecordEntry& entry, const Parameters& parameters) {
  const Reference& reference = entry.answer().reference();
  ReferenceRow& row = rows.reference.emplace();
  row.vehicle_id = entry.vehicle_id();
  row.step = entry.step();
  row.sim_time_s = calc_time(entry.step(), parameters);
  row.stage = reference.stage_index();
  row.stage_name = reference.stage_name().c_str();
  row.position = reference.position_m();
  row.velocity = reference.velocity_m_s();
  row.acceleration = reference.acceleration_m_s2();
  row.jerk = reference.jerk_m_s3();
  row.snap = reference.snap_m_s4();
  // The controller may already be in the next stage, of which the reference is not.
  const ControllerState& controller = entry.answer().controller();
  if (controller.stage_index() == row.stage && controller.stage_start_step() <= row.step)
    rows.stage_start_step = controller.stage_start_step();
}

FlightRow make_flight_row(const StepRows& rows) {
  const StateRow& state = *rows.state;
  const Eigen::Vector3d f_Q_W = bus::to_vector(rows.command->f_Q_W);
  const model::CommandedAttitude attitude = model::calc_commanded_attitude(f_Q_W);
  FlightRow row;
  row.sim_time_s = state.sim_time_s;
  row.p_WL_ref = rows.reference->position;
  row.p_WQ = state.p_WQ;
  row.roll = attitude.roll;
  row.pitch = attitude.pitch;
  row.yaw = attitude.yaw;
  row.v_WQ = state.v_WQ;
  row.n_W = bus::to_array((bus::to_vector(state.p_WL) - bus::to_vector(state.p_WQ)).normalized());
  row.alpha = state.alpha;
  row.beta = state.beta;
  row.alpha_dot = state.alpha_dot;
  row.beta_dot = state.beta_dot;
  row.f_Q_W = rows.command->f_Q_W;
  return row;
}

}  // namespace sls::record
