#include "control_client/messages.hpp"

#include "common/bus/convert.hpp"

namespace sls::control {
namespace {

FaultCode to_message(Fault fault) {
  switch (fault) {
    case Fault::kNone:
      return FAULT_NONE;
    case Fault::kFreeFall:
      return FAULT_FREE_FALL;
    case Fault::kRodLevel:
      return FAULT_ROD_LEVEL;
    case Fault::kNotFinite:
      return FAULT_NOT_FINITE;
    case Fault::kStageTimeout:
      return FAULT_STAGE_TIMEOUT;
  }
  return FAULT_NOT_FINITE;
}

::sls::MissionPhase to_message(MissionPhase phase) {
  switch (phase) {
    case MissionPhase::kRunning:
      return MISSION_RUNNING;
    case MissionPhase::kFinished:
      return MISSION_FINISHED;
    case MissionPhase::kFailed:
      return MISSION_FAILED;
  }
  return MISSION_FAILED;
}

ControllerState to_message(const ControllerMemory& memory) {
  ControllerState message;
  message.stage_index(memory.stage);
  message.stage_start_step(memory.stage_start_step);
  for (Eigen::Index i = 0; i < memory.numbers.size(); ++i)
    message.integral_m_s()[static_cast<std::size_t>(i)] = memory.numbers[i];
  return message;
}

}  // namespace

model::SlungLoadState to_model_state(const VehicleState& message) {
  model::SlungLoadState state;
  state.p_WQ = bus::to_vector(message.p_WQ_m());
  state.v_WQ = bus::to_vector(message.v_WQ_m_s());
  state.p_WL = bus::to_vector(message.p_WL_m());
  state.v_WL = bus::to_vector(message.v_WL_m_s());
  state.rod.alpha = message.alpha_rad();
  state.rod.beta = message.beta_rad();
  state.rod.alpha_dot = message.alpha_dot_rad_s();
  state.rod.beta_dot = message.beta_dot_rad_s();
  return state;
}

ControllerMemory to_memory(const ControllerState& message, int size) {
  ControllerMemory memory;
  memory.stage = message.stage_index();
  memory.stage_start_step = message.stage_start_step();
  memory.numbers = bus::to_vector(message.integral_m_s()).head(size);
  return memory;
}

ControlCommand make_command_message(const VehicleState& answered, const Answer& answer,
                                    const std::string& client_name, std::int32_t strength,
                                    std::chrono::nanoseconds compute_time) {
  ControlCommand message;
  message.run_id(answered.run_id());
  message.vehicle_id(answered.vehicle_id());
  message.step(answered.step());
  message.f_Q_W_n(bus::to_array(answer.f_Q_W));
  message.client_name(client_name);
  message.strength(strength);
  message.controller(to_message(answer.memory));
  message.mission(to_message(answer.mission));
  message.fault(to_message(answer.fault));
  message.compute_time_ns(static_cast<std::uint64_t>(compute_time.count()));
  return message;
}

Reference make_reference_message(const VehicleState& answered, const Answer& answer,
                                 const std::string& client_name) {
  Reference message;
  message.run_id(answered.run_id());
  message.vehicle_id(answered.vehicle_id());
  message.step(answered.step());
  message.sim_time_ns(answered.sim_time_ns());
  message.client_name(client_name);
  message.stage_index(answer.stage);
  message.stage_name(answer.stage_name);
  message.position_m(bus::to_array(answer.reference.position));
  message.velocity_m_s(bus::to_array(answer.reference.velocity));
  message.acceleration_m_s2(bus::to_array(answer.reference.acceleration));
  message.jerk_m_s3(bus::to_array(answer.reference.jerk));
  message.snap_m_s4(bus::to_array(answer.reference.snap));
  return message;
}

}  // namespace sls::control
