/// Builds the server's samples.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

#include "common/bus/topics.hpp"
#include "common/config/scenario.hpp"
#include "common/model/measurement.hpp"
#include "sim_server/plants/plant.hpp"

namespace sls::sim {

/// Force and fault that acted over a control period, and the controller memory in force after it.
struct Applied {
  Eigen::Vector3d answer_f_Q_W = Eigen::Vector3d::Zero();  ///< as answered, N
  Eigen::Vector3d f_Q_W = Eigen::Vector3d::Zero();         ///< as it acted, after faults, N
  ForceOrigin origin = FORCE_NONE;
  std::string controller_name;
  ControllerState memory;
};

/// `controller_name` of a force the server made by itself.
inline constexpr const char* kFailSafeName = "fail-safe";

/// A random id for a run, never 0.
std::uint64_t make_run_id();

/// The state sample for the controllers: `measured`, and what acted in the period before.
VehicleState make_state_message(std::uint32_t vehicle_id, const model::Measurement& measured,
                                const Applied& applied);

/// `plant` moves one of the vehicles; the others' are like it.
Parameters make_parameters_message(std::uint64_t run_id,
                                   const std::vector<std::uint32_t>& vehicle_ids,
                                   const config::Scenario& scenario, const Plant& plant,
                                   const std::string& version);

/// Puts the state of a step into `entry`, which may hold another one: `truth` is what the plant
/// does; `measured`, where it can differ, what is measured of it.
void fill_state(RecordEntry& entry, std::uint32_t vehicle_id, std::uint64_t step,
                const model::Measurement& truth, const model::Measurement* measured,
                const Applied& applied);

}  // namespace sls::sim
