#pragma once

#include <vector>

#include "common/bus/topics.hpp"
#include "common/config/scenario.hpp"

namespace sls::bench {

/// What the three topics carry of one step of one vehicle.
struct StepSamples {
  VehicleState state;
  ControlCommand command;
  Reference reference;
};

/// Samples of the first `steps` steps of `scenario`, flown here: real numbers, with all their
/// digits.
std::vector<StepSamples> fly_samples(const config::Scenario& scenario, std::size_t steps,
                                     std::uint64_t run_id);

/// What a server of `vehicles` vehicles claims.
Parameters make_parameters(const config::Scenario& scenario, std::uint64_t run_id,
                           std::uint32_t vehicles);

SimStatus make_status(std::uint64_t run_id, std::uint64_t index, RunPhase phase,
                      std::uint64_t step);

}  // namespace sls::bench
