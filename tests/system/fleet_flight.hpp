/// Flights of several vehicles. Each vehicle is judged separately.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "tests/system/flight.hpp"

namespace sls::test {

/// Writes a scenario of six different vehicles into `folder`, with `changes` to its text. Each has
/// its own set-points and starts the next stage on arrival: they finish at different steps, the
/// last after about 4 s.
std::string make_fleet_scenario(
    const TemporaryFolder& folder,
    const std::vector<std::pair<std::string, std::string>>& changes = {});

/// Expects that the flight of every vehicle in `ids` equals, bit for bit, its flight alone in one
/// process without DDS. Also expects that the recording ends when the last of them finishes.
void expect_each_flies_as_alone(const std::filesystem::path& recording,
                                const std::string& scenario_file,
                                const std::vector<std::uint32_t>& ids);

}  // namespace sls::test
