#include "common/bus/convert.hpp"

#include <vector>

#include "common/bus/names.hpp"

namespace sls::bus {
namespace {

// Enumerators are converted by their numbers, so that a number without a name survives.
template <class To, class From>
To to_enumerator(From value) {
  return static_cast<To>(to_number(value));
}

template <class Wire, class Model>
constexpr bool are_equal(Wire wire, Model model) {
  return to_number(wire) == to_number(model);
}
static_assert(are_equal(MissionPhase::MISSION_RUNNING, model::MissionPhase::kRunning));
static_assert(are_equal(MissionPhase::MISSION_FINISHED, model::MissionPhase::kFinished));
static_assert(are_equal(MissionPhase::MISSION_FAILED, model::MissionPhase::kFailed));
static_assert(are_equal(FaultCode::FAULT_NONE, model::ErrorCode::kNone));
static_assert(are_equal(FaultCode::FAULT_FREE_FALL, model::ErrorCode::kFreeFall));
static_assert(are_equal(FaultCode::FAULT_ROD_LEVEL, model::ErrorCode::kRodLevel));
static_assert(are_equal(FaultCode::FAULT_NOT_FINITE, model::ErrorCode::kNotFinite));
static_assert(are_equal(FaultCode::FAULT_STAGE_TIMEOUT, model::ErrorCode::kStageTimeout));
static_assert(are_equal(AnswerKind::ANSWER_NONE, model::AnswerKind::kNone));
static_assert(are_equal(AnswerKind::ANSWER_ACCEPTED, model::AnswerKind::kAccepted));
static_assert(are_equal(AnswerKind::ANSWER_HELD, model::AnswerKind::kHeld));
static_assert(are_equal(AnswerKind::ANSWER_FAIL_SAFE, model::AnswerKind::kFailSafe));
static_assert(are_equal(AnswerKind::ANSWER_REFUSED, model::AnswerKind::kRefused));
static_assert(are_equal(AnswerKind::ANSWER_LATE, model::AnswerKind::kLate));
static_assert(are_equal(ForceOrigin::FORCE_NONE, model::AnswerKind::kNone));
static_assert(are_equal(ForceOrigin::FORCE_ANSWERED, model::AnswerKind::kAccepted));
static_assert(are_equal(ForceOrigin::FORCE_HELD, model::AnswerKind::kHeld));
static_assert(are_equal(ForceOrigin::FORCE_FAIL_SAFE, model::AnswerKind::kFailSafe));

model::Numbers to_numbers(const std::vector<double>& sequence) {
  return Eigen::Map<const Eigen::VectorXd>(sequence.data(),
                                           static_cast<Eigen::Index>(sequence.size()));
}

void fill(std::vector<double>& sequence, const model::Numbers& numbers) {
  sequence.assign(numbers.data(), numbers.data() + numbers.size());
}

void fill(ControllerState& message, const model::ControllerMemory& memory) {
  message.stage_index(memory.stage);
  message.stage_start_step(memory.stage_start_step);
  fill(message.numbers(), memory.numbers);
}

void fill(model::Measurement& state, const PlantState& message) {
  const std::array<double, 4>& q_WB = message.q_WB();
  state.p_WQ = to_vector(message.p_WQ_m());
  state.v_WQ = to_vector(message.v_WQ_m_s());
  state.attitude.q_WB = Eigen::Quaterniond(q_WB[0], q_WB[1], q_WB[2], q_WB[3]);
  state.attitude.w_WB_B = to_vector(message.w_WB_B_rad_s());
  state.p_WL = to_vector(message.p_WL_m());
  state.v_WL = to_vector(message.v_WL_m_s());
  state.rod.alpha = message.alpha_rad();
  state.rod.beta = message.beta_rad();
  state.rod.alpha_dot = message.alpha_dot_rad_s();
  state.rod.beta_dot = message.beta_dot_rad_s();
  state.signals = to_numbers(message.signals());
}

}  // namespace

void fill(VehicleParameters& message, const model::SlungLoadParameters& vehicle) {
  message.quad_mass_kg(vehicle.quad_mass);
  message.load_mass_kg(vehicle.load_mass);
  message.rod_length_m(vehicle.rod_length);
  message.gravity_m_s2(vehicle.gravity);
}

void fill(PlantState& message, const model::Measurement& state) {
  const Eigen::Quaterniond& q_WB = state.attitude.q_WB;
  message.p_WQ_m(to_array(state.p_WQ));
  message.v_WQ_m_s(to_array(state.v_WQ));
  message.q_WB({q_WB.w(), q_WB.x(), q_WB.y(), q_WB.z()});
  message.w_WB_B_rad_s(to_array(state.attitude.w_WB_B));
  message.p_WL_m(to_array(state.p_WL));
  message.v_WL_m_s(to_array(state.v_WL));
  message.alpha_rad(state.rod.alpha);
  message.beta_rad(state.rod.beta);
  message.alpha_dot_rad_s(state.rod.alpha_dot);
  message.beta_dot_rad_s(state.rod.beta_dot);
  fill(message.signals(), state.signals);
}

model::Measurement to_measurement(const PlantState& message) {
  model::Measurement state;
  fill(state, message);
  return state;
}

void fill(VehicleState& message, const model::StepRecord& record) {
  message.vehicle_id(record.vehicle_id);
  fill(message.measured(), record.seen());
  message.f_Q_W_n(to_array(record.f_Q_W));
  message.force_origin(to_enumerator<ForceOrigin>(record.kind));
  message.controller_name(record.client_name);
  fill(message.controller(), record.answer.memory);
}

model::ControllerMemory to_memory(const ControllerState& message) {
  model::ControllerMemory memory;
  memory.stage = message.stage_index();
  memory.stage_start_step = message.stage_start_step();
  memory.numbers = to_numbers(message.numbers());
  return memory;
}

void fill(ControlCommand& message, std::uint32_t vehicle_id, const model::Answer& answer) {
  message.vehicle_id(vehicle_id);
  message.f_Q_W_n(to_array(answer.f_Q_W));
  Reference& reference = message.reference();
  reference.stage_index(answer.stage);
  reference.stage_name(answer.stage_name);
  reference.position_m(to_array(answer.reference.position));
  reference.velocity_m_s(to_array(answer.reference.velocity));
  reference.acceleration_m_s2(to_array(answer.reference.acceleration));
  reference.jerk_m_s3(to_array(answer.reference.jerk));
  reference.snap_m_s4(to_array(answer.reference.snap));
  fill(message.controller(), answer.memory);
  message.mission(to_enumerator<MissionPhase>(answer.mission));
  message.fault(to_enumerator<FaultCode>(answer.error_code));
  message.compute_time_ns(answer.compute_time.count());
}

void fill(model::Answer& answer, const ControlCommand& message) {
  const Reference& reference = message.reference();
  answer.f_Q_W = to_vector(message.f_Q_W_n());
  answer.stage = reference.stage_index();
  answer.stage_name = reference.stage_name().c_str();
  answer.reference.position = to_vector(reference.position_m());
  answer.reference.velocity = to_vector(reference.velocity_m_s());
  answer.reference.acceleration = to_vector(reference.acceleration_m_s2());
  answer.reference.jerk = to_vector(reference.jerk_m_s3());
  answer.reference.snap = to_vector(reference.snap_m_s4());
  answer.memory = to_memory(message.controller());
  answer.mission = to_enumerator<model::MissionPhase>(message.mission());
  answer.error_code = to_enumerator<model::ErrorCode>(message.fault());
  answer.compute_time = decltype(answer.compute_time)(message.compute_time_ns());
}

void fill(RecordEntry& message, const model::StepRecord& record) {
  message.vehicle_id(record.vehicle_id);
  message.step(record.step);
  message.kind(to_enumerator<AnswerKind>(record.kind));
  fill(message.truth(), record.truth);
  message.measured().resize(record.measured ? 1 : 0);
  if (record.measured) fill(message.measured().front(), *record.measured);
  message.f_Q_W_n(to_array(record.f_Q_W));
  message.answered_step(record.answered_step);
  message.client_name(record.client_name);
  fill(message.answer(), record.vehicle_id, record.answer);
}

void fill(model::StepRecord& record, const RecordEntry& message) {
  record.vehicle_id = message.vehicle_id();
  record.step = message.step();
  record.kind = to_enumerator<model::AnswerKind>(message.kind());
  fill(record.truth, message.truth());
  if (message.measured().empty()) {
    record.measured.reset();
  } else {
    if (!record.measured) record.measured.emplace();
    fill(*record.measured, message.measured().front());
  }
  record.f_Q_W = to_vector(message.f_Q_W_n());
  record.answered_step = message.answered_step();
  record.client_name = message.client_name().c_str();
  fill(record.answer, message.answer());
}

}  // namespace sls::bus
