/// Conversions between wire types and the model's types. `fill` overwrites all that its first
/// argument held and reuses its memory.
#pragma once

#include <Eigen/Core>
#include <array>

#include "common/bus/topics.hpp"
#include "common/model/answer.hpp"
#include "common/model/measurement.hpp"
#include "common/model/parameters.hpp"
#include "common/model/step_record.hpp"

namespace sls::bus {

inline std::array<double, 3> to_array(const Eigen::Vector3d& vector) {
  return {vector.x(), vector.y(), vector.z()};
}

inline Eigen::Vector3d to_vector(const std::array<double, 3>& array) {
  return {array[0], array[1], array[2]};
}

void fill(VehicleParameters& message, const model::SlungLoadParameters& vehicle);

void fill(PlantState& message, const model::Measurement& state);
model::Measurement to_measurement(const PlantState& message);

/// The state sample for the controllers. Kind, client and answer of `record`, whose step waits for
/// its answer, are those of the period before it.
void fill(VehicleState& message, const model::StepRecord& record);
model::ControllerMemory to_memory(const ControllerState& message);

void fill(ControlCommand& message, std::uint32_t vehicle_id, const model::Answer& answer);
void fill(model::Answer& answer, const ControlCommand& message);

void fill(RecordEntry& message, const model::StepRecord& record);
void fill(model::StepRecord& record, const RecordEntry& message);

}  // namespace sls::bus
