/// Builds the server's samples.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

#include "common/bus/topics.hpp"
#include "common/config/scenario.hpp"
#include "common/model/state.hpp"

namespace sls::sim {

/// What acted over a control period, and the controller memory in force after it.
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

/// State `step`: `truth` is what the plant does, `measured` what the controllers are to see of it.
VehicleState make_state_message(std::uint64_t run_id, std::uint32_t vehicle_id, std::uint64_t step,
                                std::int64_t period_ns, const model::SlungLoadState& measured,
                                const model::SlungLoadState& truth, const Applied& applied);

Parameters make_parameters_message(std::uint64_t run_id,
                                   const std::vector<std::uint32_t>& vehicle_ids,
                                   const config::Scenario& scenario, const std::string& version);

}  // namespace sls::sim
