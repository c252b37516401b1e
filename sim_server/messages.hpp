/// Builds the server's samples.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>

#include "common/bus/topics.hpp"
#include "common/config/scenario.hpp"
#include "common/model/state.hpp"

namespace sls::sim {

/// What was applied over the period before a state, and the controller memory accepted with it.
struct Applied {
  Eigen::Vector3d f_Q_W = Eigen::Vector3d::Zero();  ///< N
  std::string controller_name;
  ControllerState memory;
};

VehicleState make_state_message(std::uint64_t run_id, std::uint32_t vehicle_id, std::uint64_t step,
                                std::int64_t period_ns, const model::SlungLoadState& state,
                                const Applied& applied);

Parameters make_parameters_message(std::uint64_t run_id, std::uint32_t vehicle_id,
                                   const config::Scenario& scenario, const std::string& version);

}  // namespace sls::sim
