/// A server without plant and clients: sends a recorder a finished flight as fast as it takes it.
#pragma once

#include <cstdint>
#include <filesystem>
#include <nlohmann/json_fwd.hpp>

#include "common/config/scenario.hpp"

namespace sls::bench {

struct FeederOptions {
  std::filesystem::path qos_file;
  int domain = 0;
  std::uint32_t vehicles = 1;
  std::size_t steps = 1000;
};

/// Keeps as far ahead of the recorder's last complete step as a server in lockstep may. Returns
/// `rows` (of state.csv, command.csv, reference.csv and flight.csv together) and `seconds`, from
/// the first sample until the recorder has announced the last step.
/// @throws app::RunError if no recorder comes, or it does not come to the end.
nlohmann::json feed_recorder(const config::Scenario& scenario, const FeederOptions& options);

}  // namespace sls::bench
