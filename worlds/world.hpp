/// One world: its programs on a simulated network, driven by one thread and one queue of events.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "worlds/plan.hpp"
#include "worlds/setting.hpp"

namespace sls::worlds {

struct Verdict {
  std::vector<std::string> findings;  ///< broken properties; empty: none
  std::uint64_t hash = 0;             ///< of the trace
  std::vector<std::string> trace;     ///< if it was wanted
  double simulated_s = 0;
  std::uint64_t events = 0;
  std::uint64_t steps = 0;             ///< flown by all servers
  std::vector<FlightSummary> flights;  ///< those that were finished
  int complete = 0;                    ///< recordings
  std::uint64_t begun_faults = 0;      ///< the others would have come after the end of faults
};

/// Flies the world of `plan`. Its files, if it has some, are in `folder` until it is over.
Verdict fly_world(const Plan& plan, const std::vector<FlownScenario>& scenarios,
                  const std::filesystem::path& folder, bool keeps_trace = false);

}  // namespace sls::worlds
