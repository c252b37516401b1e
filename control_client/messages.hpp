/// Conversion between wire types and the controller's types.
#pragma once

#include <chrono>
#include <cstdint>

#include "common/bus/topics.hpp"
#include "control_client/flight_controller.hpp"

namespace sls::control {

ControllerMemory to_memory(const ControllerState& message);

/// Writes an answer into `message` and replaces all that it held.
void fill_command_message(ControlCommand& message, std::uint32_t vehicle_id, const Answer& answer,
                          std::chrono::nanoseconds compute_time);

ControlCommand make_command_message(std::uint32_t vehicle_id, const Answer& answer,
                                    std::chrono::nanoseconds compute_time);

}  // namespace sls::control
