/// Builds the server's samples.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

#include "common/bus/topics.hpp"
#include "common/config/scenario.hpp"
#include "common/model/measurement.hpp"
#include "sim_server/core/vehicle.hpp"
#include "sim_server/plants/plant.hpp"

namespace sls::sim {

/// A random id for a run, never 0.
std::uint64_t make_run_id();

/// Writes the state for the controllers into `message`, over any earlier content: `measured`, and
/// `applied` of the previous period.
void fill_state_message(VehicleState& message, std::uint32_t vehicle_id,
                        const model::Measurement& measured, const Applied& applied);

/// `plant` is that of one of the vehicles; those of the others have the same signals. Call once the
/// plants are made: the library's hash is that of the one that is loaded.
Parameters make_parameters_message(std::uint64_t run_id,
                                   const std::vector<std::uint32_t>& vehicle_ids,
                                   const config::Scenario& scenario, const Plant& plant,
                                   const std::string& version);

/// Writes the state of a step into `entry`, over any earlier content. `truth` is the state of the
/// plant; `measured` is the measurement, or null if it cannot differ from the truth.
void fill_state(RecordEntry& entry, std::uint32_t vehicle_id, std::uint64_t step,
                const model::Measurement& truth, const model::Measurement* measured,
                const Applied& applied);

}  // namespace sls::sim
