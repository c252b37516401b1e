/// A flight in one process with the same recording as a flight of the three programs.
#pragma once

#include <filesystem>
#include <vector>

#include "closed_loop/flight.hpp"
#include "common/config/scenario.hpp"

namespace sls::closed_loop {

/// Result of a flight.
struct FlightEnd {
  std::uint64_t last_step = 0;
  std::string failure;       ///< why it failed; empty if every mission was finished
  bool is_complete = false;  ///< the recording
};

/// Flies all vehicles of `scenario` in lockstep and records them in `folder`, which must be new or
/// empty; with `force`, an old recording in it is replaced. The files hold the same data, with the
/// same certificate, as those of the three programs.
/// @throws config::ConfigError as Flight does, before the folder is touched, or for the folder.
/// @throws std::system_error with the name of the file if it cannot be written.
FlightEnd fly_recorded(const config::Scenario& scenario, const FlightOptions& options,
                       const std::filesystem::path& folder, bool force);

}  // namespace sls::closed_loop
