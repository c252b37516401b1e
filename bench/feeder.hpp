/// A server without plant and clients: sends a finished flight to a recorder, as fast as the
/// recorder takes it.
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

/// Stays ahead of the recorder's last complete step by as many steps as a server in lockstep may.
/// Returns `rows` (of state.csv, command.csv, reference.csv and flight.csv together) and `seconds`,
/// from the first sample until the recorder has announced the last step.
/// @throws app::RunError if no recorder joins, or it does not announce the last step.
nlohmann::json feed_recorder(const config::Scenario& scenario, const FeederOptions& options);

}  // namespace sls::bench
