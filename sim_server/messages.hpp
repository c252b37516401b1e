/// Conversions of the server's samples.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "common/bus/topics.hpp"
#include "common/config/scenario.hpp"
#include "sim_server/core/command_sample.hpp"
#include "sim_server/plants/plant.hpp"

namespace sls::sim {

/// A random id for a run, never 0.
std::uint64_t make_run_id();

/// `plant` is that of one of the vehicles; those of the others have the same signals. Call once the
/// plants are made: the library's hash is that of the one that is loaded.
Parameters make_parameters_message(std::uint64_t run_id,
                                   const std::vector<std::uint32_t>& vehicle_ids,
                                   const config::Scenario& scenario, const Plant& plant,
                                   const std::string& version);

/// Fills in the content of a sample of sls/command, not its sender and its times. Overwrites all
/// that `received` held and reuses its memory.
void fill(CommandSample& received, const Commands& sample);

}  // namespace sls::sim
