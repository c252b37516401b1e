#include "recorder/sinks/mcap/entry_message.hpp"

#include <slsPubSubTypes.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "common/bus/convert.hpp"
#include "fastcdr_api.hpp"
#include "fastdds_types.hpp"

namespace sls::record {
namespace {

using Eigen::Vector3d;
using model::AnswerKind;

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

/// The value that the number has when read from a CSV file.
double as_in_file(double number) {
  if (!std::isnan(number)) return number;
  return std::copysign(kNone, std::signbit(number) ? -1.0 : 1.0);
}

template <class Vector>
Vector as_in_file(const Vector& vector) {
  return vector.unaryExpr([](double number) { return as_in_file(number); });
}

model::Measurement as_in_file(const model::Measurement& motion, bool has_attitude) {
  const auto& [alpha, beta, alpha_dot, beta_dot] = motion.rod;
  model::Measurement shown;  // level if state.csv has no attitude
  shown.p_WQ = as_in_file(motion.p_WQ);
  shown.v_WQ = as_in_file(motion.v_WQ);
  shown.p_WL = as_in_file(motion.p_WL);
  shown.v_WL = as_in_file(motion.v_WL);
  shown.rod = {as_in_file(alpha), as_in_file(beta), as_in_file(alpha_dot), as_in_file(beta_dot)};
  if (has_attitude) {
    shown.attitude.q_WB = as_in_file(motion.attitude.q_WB.coeffs());
    shown.attitude.w_WB_B = as_in_file(motion.attitude.w_WB_B);
  }
  shown.signals = as_in_file(motion.signals);
  return shown;
}

/// The motion of a step without a state row: all numbers are NaN.
model::Measurement make_unknown_motion() {
  const Vector3d none = Vector3d::Constant(kNone);
  model::Measurement motion;
  motion.p_WQ = motion.v_WQ = motion.p_WL = motion.v_WL = motion.attitude.w_WB_B = none;
  motion.rod = {kNone, kNone, kNone, kNone};
  motion.attitude.q_WB.coeffs().setConstant(kNone);
  return motion;
}

AnswerKind find_kind(const StepRows& rows) {
  if (!rows.has_command) return rows.has_state ? AnswerKind::kNone : AnswerKind::kLate;
  return rows.is_unanswered() ? rows.kind : AnswerKind::kAccepted;
}

}  // namespace

EntryMessage::EntryMessage() : bytes_(bus::max_size_of(RecordEntryPubSubType())) {}

void EntryMessage::fill(const StepRows& rows) {
  const model::Answer& answer = rows.answer;
  model::StepRecord shown;  // what is in no row stays as it is in a new record
  shown.vehicle_id = rows.vehicle_id;
  shown.step = rows.step;
  shown.kind = find_kind(rows);
  shown.truth = rows.has_state ? as_in_file(rows.truth, rows.has_attitude) : make_unknown_motion();
  shown.f_Q_W = rows.has_state ? as_in_file(rows.f_Q_W) : Vector3d::Constant(kNone);
  if (rows.measured) shown.measured = as_in_file(*rows.measured, rows.has_attitude);
  shown.answer.f_Q_W = rows.has_command ? as_in_file(answer.f_Q_W) : Vector3d::Constant(kNone);
  if (rows.has_command) {
    shown.client_name = rows.client_name;
    if (!rows.is_unanswered()) shown.answered_step = rows.step;
    if (!rows.is_unanswered() && answer.error_code <= model::ErrorCode::kStageTimeout)
      shown.answer.error_code = answer.error_code;
  }
  model::Reference& reference = shown.answer.reference;
  if (rows.has_reference) {
    shown.answer.stage = answer.stage;
    shown.answer.stage_name = answer.stage_name;
    reference.position = as_in_file(answer.reference.position);
    reference.velocity = as_in_file(answer.reference.velocity);
    reference.acceleration = as_in_file(answer.reference.acceleration);
    reference.jerk = as_in_file(answer.reference.jerk);
    reference.snap = as_in_file(answer.reference.snap);
  } else {
    reference.position = reference.velocity = reference.acceleration = reference.jerk =
        reference.snap = Vector3d::Constant(kNone);
  }
  bus::fill(entry_, shown);
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
