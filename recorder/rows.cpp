#include "recorder/rows.hpp"

#include <limits>

namespace sls::record {
namespace {

double calc_time(std::uint64_t step, const Parameters& parameters) {
  return static_cast<double>(static_cast<std::int64_t>(step) * parameters.period_ns()) / 1e9;
}

/// The value in `row`, or a new one.
template <class Row>
Row& reuse(std::optional<Row>& row) {
  return row ? *row : row.emplace();
}

void fill(StateRow& row, const RecordEntry& entry, const PlantState& state,
          const Parameters& parameters) {
  row.vehicle_id = entry.vehicle_id();
  row.step = entry.step();
  row.sim_time_s = calc_time(entry.step(), parameters);
  row.plant = state;
  row.f_Q_W = entry.f_Q_W_n();
  row.has_attitude = parameters.has_attitude();
  // Rows must have as many fields as the header, even if the sample has another number of signals.
  row.plant.signals().resize(parameters.signals().size(), std::numeric_limits<double>::quiet_NaN());
}

void fill(CommandRow& row, const RecordEntry& entry) {
  const ControlCommand& answer = entry.answer();
  row.vehicle_id = entry.vehicle_id();
  row.step = entry.step();
  row.controller = entry.client_name().c_str();
  row.f_Q_W = answer.f_Q_W_n();
  if (entry.kind() == AnswerKind::ANSWER_HELD)
    row.fault = CommandRow::kHeld;
  else if (entry.kind() == AnswerKind::ANSWER_FAIL_SAFE)
    row.fault = CommandRow::kFailSafe;
  else
    row.fault = bus::to_string(answer.fault());
  row.compute_us = row.is_unanswered() ? 0.0 : static_cast<double>(answer.compute_time_ns()) / 1e3;
}

}  // namespace

void fill_rows(StepRows& rows, const RecordEntry& entry, const Parameters& parameters) {
  rows.vehicle_id = entry.vehicle_id();
  rows.step = entry.step();
  rows.stage_start_step.reset();
  fill(reuse(rows.state), entry, entry.truth(), parameters);
  if (entry.measured().empty())
    rows.measured.reset();
  else
    fill(reuse(rows.measured), entry, entry.measured().front(), parameters);
  if (entry.kind() == AnswerKind::ANSWER_NONE)
    rows.command.reset();
  else
    fill(reuse(rows.command), entry);
  if (rows.command && !rows.command->is_unanswered())
    add_reference(rows, entry, parameters);
  else
    rows.reference.reset();
}

StepRows make_rows(const RecordEntry& entry, const Parameters& parameters) {
  StepRows rows;
  fill_rows(rows, entry, parameters);
  return rows;
}

void add_reference(StepRows& rows, const RecordEntry& entry, const Parameters& parameters) {
  ReferenceRow& row = reuse(rows.reference);
  row.vehicle_id = entry.vehicle_id();
  row.step = entry.step();
  row.sim_time_s = calc_time(entry.step(), parameters);
  row.reference = entry.answer().reference();
  row.stage_name = row.reference.stage_name().c_str();
  // The controller may already be in the next stage, while the reference is of the previous one.
  const ControllerState& controller = entry.answer().controller();
  if (controller.stage_index() == row.reference.stage_index() &&
      controller.stage_start_step() <= row.step)
    rows.stage_start_step = controller.stage_start_step();
}

}  // namespace sls::record
