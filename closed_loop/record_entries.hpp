/// The entries that a server would send to recorders, for a flight in one process.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "closed_loop/flight.hpp"
#include "common/bus/topics.hpp"
#include "common/config/scenario.hpp"

namespace sls::closed_loop {

/// Writes a step of one vehicle into `entry` and replaces all that it held. `is_refused`: its
/// answer failed the flight.
void fill_entry(RecordEntry& entry, std::uint32_t vehicle_id, const FlownStep& flown,
                const std::string& controller_name, bool is_refused = false);

/// The entry of a step of one vehicle. `is_refused`: its answer failed the flight.
RecordEntry make_entry(std::uint32_t vehicle_id, const FlownStep& flown,
                       const std::string& controller_name, bool is_refused = false);

/// Entries of the first `steps` steps of vehicle 0 of `scenario`.
std::vector<RecordEntry> fly_entries(const config::Scenario& scenario, std::size_t steps);

/// Parameters of a server with `vehicles` vehicles, all equal to the first one except the id.
Parameters make_parameters(const config::Scenario& scenario, std::uint64_t run_id,
                           std::uint32_t vehicles);

SimStatus make_status(std::uint64_t run_id, std::uint64_t index, RunPhase phase,
                      std::uint64_t step);

}  // namespace sls::closed_loop
