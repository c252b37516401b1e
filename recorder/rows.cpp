#include "recorder/rows.hpp"

#include <limits>

namespace sls::record {
namespace {

double calc_time(std::uint64_t step, const RowFormat& format) {
  return static_cast<double>(static_cast<std::int64_t>(step) * format.period_ns) / 1e9;
}

/// Rows must have as many fields as the header, even if the sample has another number of signals.
void fit(model::Numbers& signals, int count) {
  const Eigen::Index given = signals.size();
  if (given == count) return;
  signals.conservativeResize(count);
  for (Eigen::Index i = given; i < count; ++i)
    signals[i] = std::numeric_limits<double>::quiet_NaN();
}

void fill_reference_columns(StepRows& rows, const RowFormat& format) {
  rows.has_reference = true;
  rows.reference_time_s = calc_time(rows.step, format);
  // The controller may already be in the next stage, while the reference is of the previous one.
  const model::ControllerMemory& memory = rows.answer.memory;
  if (memory.stage == rows.answer.stage && memory.stage_start_step <= rows.step)
    rows.stage_start_step = memory.stage_start_step;
}

}  // namespace

RowFormat make_row_format(const Parameters& parameters) {
  return {parameters.period_ns(), parameters.has_attitude(),
          static_cast<int>(parameters.signals().size())};
}

void fill_columns(StepRows& rows, const RowFormat& format) {
  rows.has_state = true;
  rows.has_attitude = format.has_attitude;
  rows.state_time_s = calc_time(rows.step, format);
  fit(rows.truth.signals, format.signals);
  if (rows.measured) fit(rows.measured->signals, format.signals);
  rows.has_command = rows.kind != model::AnswerKind::kNone;
  rows.fault = rows.kind == model::AnswerKind::kHeld       ? StepRows::kHeld
               : rows.kind == model::AnswerKind::kFailSafe ? StepRows::kFailSafe
                                                           : to_string(rows.answer.error_code);
  rows.compute_us =
      rows.is_unanswered() ? 0.0 : static_cast<double>(rows.answer.compute_time.count()) / 1e3;
  rows.has_reference = false;
  rows.stage_start_step.reset();
  if (rows.has_command && !rows.is_unanswered()) fill_reference_columns(rows, format);
}

void add_reference(StepRows& rows, const model::StepRecord& late, const RowFormat& format) {
  rows.answer.reference = late.answer.reference;
  rows.answer.stage = late.answer.stage;
  rows.answer.stage_name = late.answer.stage_name;
  rows.answer.memory = late.answer.memory;
  fill_reference_columns(rows, format);
}

}  // namespace sls::record
