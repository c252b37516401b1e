/// A run that is flown in this process, as a server would send it to recorders.
#pragma once

#include <cstdint>
#include <vector>

#include "common/bus/topics.hpp"
#include "common/config/scenario.hpp"
#include "common/model/step_record.hpp"

namespace sls::bench {

/// The first `steps` steps of vehicle 0 of `scenario`. The last answer says that the mission is
/// finished.
std::vector<model::StepRecord> fly_records(const config::Scenario& scenario, std::size_t steps);

/// Parameters of a server with `vehicles` vehicles, all equal to the first one except the id.
Parameters make_parameters(const config::Scenario& scenario, std::uint64_t run_id,
                           std::uint32_t vehicles);

SimStatus make_status(std::uint64_t run_id, std::uint64_t index, RunPhase phase,
                      std::uint64_t step);

}  // namespace sls::bench
