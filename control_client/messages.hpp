/// Between wire types and the controller's types.
#pragma once

#include <chrono>
#include <string>

#include "common/bus/topics.hpp"
#include "control_client/flight_controller.hpp"

namespace sls::control {

model::SlungLoadState to_model_state(const VehicleState& message);
/// The memory of a law that remembers `size` numbers.
ControllerMemory to_memory(const ControllerState& message, int size);

ControlCommand make_command_message(const VehicleState& answered, const Answer& answer,
                                    const std::string& client_name, std::int32_t strength,
                                    std::chrono::nanoseconds compute_time);
Reference make_reference_message(const VehicleState& answered, const Answer& answer,
                                 const std::string& client_name);

}  // namespace sls::control
