#include "recorder/rows.hpp"

#include "common/bus/names.hpp"

namespace sls::record {
namespace {

double to_seconds(std::int64_t nanoseconds) { return static_cast<double>(nanoseconds) / 1e9; }

StateRow make_row(const VehicleState& state) {
  const PlantState& truth = state.truth();
  StateRow row;
  row.vehicle_id = state.vehicle_id();
  row.step = state.step();
  row.sim_time_s = to_seconds(state.sim_time_ns());
  row.p_WQ = truth.p_WQ_m();
  row.v_WQ = truth.v_WQ_m_s();
  row.p_WL = truth.p_WL_m();
  row.v_WL = truth.v_WL_m_s();
  row.alpha = truth.alpha_rad();
  row.beta = truth.beta_rad();
  row.alpha_dot = truth.alpha_dot_rad_s();
  row.beta_dot = truth.beta_dot_rad_s();
  row.f_Q_W = state.f_Q_W_n();
  return row;
}

std::string_view name_fault(const ControlCommand& command, AnswerOrigin origin) {
  if (origin == AnswerOrigin::kHeld) return CommandRow::kHeld;
  if (origin == AnswerOrigin::kFailSafe) return CommandRow::kFailSafe;
  return bus::to_string(command.fault());
}

CommandRow make_row(const ControlCommand& command, AnswerOrigin origin) {
  CommandRow row;
  row.vehicle_id = command.vehicle_id();
  row.step = command.step();
  row.controller = command.client_name().to_string();
  row.f_Q_W = command.f_Q_W_n();
  row.compute_us = static_cast<double>(command.compute_time_ns()) / 1e3;
  row.fault = name_fault(command, origin);
  return row;
}

ReferenceRow make_row(const Reference& reference) {
  ReferenceRow row;
  row.vehicle_id = reference.vehicle_id();
  row.step = reference.step();
  row.sim_time_s = to_seconds(reference.sim_time_ns());
  row.stage = reference.stage_index();
  row.stage_name = reference.stage_name().to_string();
  row.derivatives = {reference.position_m(), reference.velocity_m_s(),
                     reference.acceleration_m_s2(), reference.jerk_m_s3(), reference.snap_m_s4()};
  return row;
}

/// Nothing where the answer in force is not the one that `reference` belongs to.
std::optional<std::uint64_t> find_stage_start(const StepRecord& record) {
  if (!record.command || !record.reference) return std::nullopt;
  const ControllerState& controller = record.command->controller();
  const bool is_of_reference = controller.stage_index() == record.reference->stage_index() &&
                               controller.stage_start_step() <= record.step;
  return is_of_reference ? std::optional(controller.stage_start_step()) : std::nullopt;
}

}  // namespace

StepRows make_rows(std::uint32_t vehicle_id, const StepRecord& record) {
  StepRows rows;
  rows.vehicle_id = vehicle_id;
  rows.step = record.step;
  if (record.state) rows.state = make_row(*record.state);
  if (record.command) rows.command = make_row(*record.command, record.origin);
  if (record.reference) rows.reference = make_row(*record.reference);
  rows.stage_start_step = find_stage_start(record);
  return rows;
}

}  // namespace sls::record
