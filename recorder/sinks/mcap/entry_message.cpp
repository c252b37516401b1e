#include "recorder/sinks/mcap/entry_message.hpp"

#include <slsPubSubTypes.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "common/bus/names.hpp"
#include "fastcdr_api.hpp"
#include "fastdds_types.hpp"

namespace sls::record {
namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

/// The value that the number has when read from a CSV file.
double as_in_file(double number) {
  if (!std::isnan(number)) return number;
  return std::copysign(kNone, std::signbit(number) ? -1.0 : 1.0);
}

template <class Numbers>
void copy(const Numbers& from, Numbers& to) {
  std::transform(from.begin(), from.end(), to.begin(), as_in_file);
}

void fill(PlantState& state, const StateRow& row) {
  const PlantState& plant = row.plant;
  copy(plant.p_WQ_m(), state.p_WQ_m());
  copy(plant.v_WQ_m_s(), state.v_WQ_m_s());
  copy(plant.p_WL_m(), state.p_WL_m());
  copy(plant.v_WL_m_s(), state.v_WL_m_s());
  state.alpha_rad(as_in_file(plant.alpha_rad()));
  state.beta_rad(as_in_file(plant.beta_rad()));
  state.alpha_dot_rad_s(as_in_file(plant.alpha_dot_rad_s()));
  state.beta_dot_rad_s(as_in_file(plant.beta_dot_rad_s()));
  state.q_WB({1, 0, 0, 0});  // level if state.csv has no attitude
  state.w_WB_B_rad_s({});
  if (row.has_attitude) {
    copy(plant.q_WB(), state.q_WB());
    copy(plant.w_WB_B_rad_s(), state.w_WB_B_rad_s());
  }
  state.signals().resize(plant.signals().size());
  copy(plant.signals(), state.signals());
}

/// A state for a step without a state row: all numbers are NaN.
PlantState make_unknown_state() {
  PlantState state;
  for (auto* numbers : {&state.p_WQ_m(), &state.v_WQ_m_s(), &state.w_WB_B_rad_s(), &state.p_WL_m(),
                        &state.v_WL_m_s()})
    numbers->fill(kNone);
  state.q_WB().fill(kNone);
  state.alpha_rad(kNone);
  state.beta_rad(kNone);
  state.alpha_dot_rad_s(kNone);
  state.beta_dot_rad_s(kNone);
  return state;
}

void fill(Reference& reference, const std::optional<ReferenceRow>& row) {
  if (!row) {
    reference.stage_index(0);
    reference.stage_name("");
    for (auto* numbers :
         {&reference.position_m(), &reference.velocity_m_s(), &reference.acceleration_m_s2(),
          &reference.jerk_m_s3(), &reference.snap_m_s4()})
      numbers->fill(kNone);
    return;
  }
  const Reference& from = row->reference;
  reference.stage_index(from.stage_index());
  reference.stage_name(row->stage_name);
  copy(from.position_m(), reference.position_m());
  copy(from.velocity_m_s(), reference.velocity_m_s());
  copy(from.acceleration_m_s2(), reference.acceleration_m_s2());
  copy(from.jerk_m_s3(), reference.jerk_m_s3());
  copy(from.snap_m_s4(), reference.snap_m_s4());
}

AnswerKind find_kind(const StepRows& rows) {
  if (!rows.command) return rows.state ? AnswerKind::ANSWER_NONE : AnswerKind::ANSWER_LATE;
  if (rows.command->fault == CommandRow::kHeld) return AnswerKind::ANSWER_HELD;
  if (rows.command->fault == CommandRow::kFailSafe) return AnswerKind::ANSWER_FAIL_SAFE;
  return AnswerKind::ANSWER_ACCEPTED;
}

FaultCode find_fault(const CommandRow& row) {
  for (const FaultCode fault : {FaultCode::FAULT_FREE_FALL, FaultCode::FAULT_ROD_LEVEL,
                                FaultCode::FAULT_NOT_FINITE, FaultCode::FAULT_STAGE_TIMEOUT})
    if (row.fault == bus::to_string(fault)) return fault;
  return FaultCode::FAULT_NONE;
}

void fill(RecordEntry& entry, const std::optional<CommandRow>& row) {
  ControlCommand& answer = entry.answer();
  if (!row) {
    answer.f_Q_W_n().fill(kNone);
    answer.fault(FaultCode::FAULT_NONE);
    entry.client_name("");
    entry.answered_step(0);
    return;
  }
  copy(row->f_Q_W, answer.f_Q_W_n());
  answer.fault(find_fault(*row));
  entry.client_name(row->controller);
  entry.answered_step(row->is_unanswered() ? 0 : row->step);
}

}  // namespace

EntryMessage::EntryMessage()
    : bytes_(bus::max_size_of(RecordEntryPubSubType())) {}

void EntryMessage::fill(const StepRows& rows) {
  entry_.vehicle_id(rows.vehicle_id);
  entry_.step(rows.step);
  entry_.kind(find_kind(rows));
  if (rows.state) {
    record::fill(entry_.truth(), *rows.state);
    copy(rows.state->f_Q_W, entry_.f_Q_W_n());
  } else {
    entry_.truth(make_unknown_state());
    entry_.f_Q_W_n().fill(kNone);
  }
  entry_.measured().resize(rows.measured ? 1 : 0);
  if (rows.measured) record::fill(entry_.measured().front(), *rows.measured);
  entry_.answer().vehicle_id(rows.vehicle_id);
  record::fill(entry_, rows.command);
  record::fill(entry_.answer().reference(), rows.reference);
}

std::string_view EntryMessage::serialize(const StepRows& rows) {
  fill(rows);
  std::fill(bytes_.begin(), bytes_.end(), '\0');  // Fast CDR does not write padding bytes
  eprosima::fastcdr::FastBuffer buffer(bytes_.data(), bytes_.size());
  bus::Cdr cdr = bus::make_cdr(buffer, bus::Cdr::LITTLE_ENDIANNESS);
  cdr.serialize_encapsulation();
  bus::write_message(entry_, cdr);
  return {bytes_.data(), bus::count_bytes(cdr)};
}

}  // namespace sls::record
