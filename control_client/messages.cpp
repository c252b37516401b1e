#include "control_client/messages.hpp"

#include "common/bus/convert.hpp"

namespace sls::control {
namespace {

FaultCode to_message(Fault fault) {
  switch (fault) {
    case Fault::kNone:
      return FaultCode::FAULT_NONE;
    case Fault::kFreeFall:
      return FaultCode::FAULT_FREE_FALL;
    case Fault::kRodLevel:
      return FaultCode::FAULT_ROD_LEVEL;
    case Fault::kNotFinite:
      return FaultCode::FAULT_NOT_FINITE;
    case Fault::kStageTimeout:
      return FaultCode::FAULT_STAGE_TIMEOUT;
  }
  return FaultCode::FAULT_NOT_FINITE;
}

::sls::MissionPhase to_message(MissionPhase phase) {
  switch (phase) {
    case MissionPhase::kRunning:
      return sls::MissionPhase::MISSION_RUNNING;
    case MissionPhase::kFinished:
      return sls::MissionPhase::MISSION_FINISHED;
    case MissionPhase::kFailed:
      return sls::MissionPhase::MISSION_FAILED;
  }
  return sls::MissionPhase::MISSION_FAILED;
}

void fill(ControllerState& message, const ControllerMemory& memory) {
  message.stage_index(memory.stage);
  message.stage_start_step(memory.stage_start_step);
  bus::fill(message.numbers(), memory.numbers);
}

void fill(Reference& message, const Answer& answer) {
  message.stage_index(answer.stage);
  message.stage_name(answer.stage_name);
  message.position_m(bus::to_array(answer.reference.position));
  message.velocity_m_s(bus::to_array(answer.reference.velocity));
  message.acceleration_m_s2(bus::to_array(answer.reference.acceleration));
  message.jerk_m_s3(bus::to_array(answer.reference.jerk));
  message.snap_m_s4(bus::to_array(answer.reference.snap));
}

}  // namespace

ControllerMemory to_memory(const ControllerState& message) {
  ControllerMemory memory;
  memory.stage = message.stage_index();
  memory.stage_start_step = message.stage_start_step();
  memory.numbers = bus::to_numbers(message.numbers());
  return memory;
}

void fill_command_message(ControlCommand& message, std::uint32_t vehicle_id, const Answer& answer,
                          std::chrono::nanoseconds compute_time) {
  message.vehicle_id(vehicle_id);
  message.f_Q_W_n(bus::to_array(answer.f_Q_W));
  fill(message.reference(), answer);
  fill(message.controller(), answer.memory);
  message.mission(to_message(answer.mission));
  message.fault(to_message(answer.fault));
  message.compute_time_ns(static_cast<std::uint64_t>(compute_time.count()));
}

ControlCommand make_command_message(std::uint32_t vehicle_id, const Answer& answer,
                                    std::chrono::nanoseconds compute_time) {
  ControlCommand message;
  fill_command_message(message, vehicle_id, answer, compute_time);
  return message;
}

}  // namespace sls::control
