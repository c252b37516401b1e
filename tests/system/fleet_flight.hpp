/// Flights of several vehicles, judged vehicle by vehicle.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "tests/system/flight.hpp"

namespace sls::test {

/// Writes a scenario of six different vehicles into `folder`, with `changes` to its text. Each goes
/// to a place of its own, and on as soon as it is there: they finish at different steps, the last
/// after about 4 s.
std::string make_fleet_scenario(
    const TemporaryFolder& folder,
    const std::vector<std::pair<std::string, std::string>>& changes = {});

/// Expects that every vehicle in `ids` of a recording of `scenario_file` flew bit for bit what the
/// loop of that vehicle alone flies in one process, without DDS and without a fleet; and that the
/// recording ends with the last of them to finish.
void expect_each_flies_as_alone(const std::filesystem::path& recording,
                                const std::string& scenario_file,
                                const std::vector<std::uint32_t>& ids);

/// Rows of state.csv, command.csv and reference.csv of one vehicle, as text, without vehicle_id and
/// what differs between equal flights (controller, compute_us).
struct VehicleRows {
  std::vector<std::string> state, command, reference;
};
VehicleRows read_vehicle_rows(const std::filesystem::path& recording, std::uint32_t id);

}  // namespace sls::test
