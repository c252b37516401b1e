#pragma once

#include <string>
#include <vector>

#include "worlds/setting.hpp"

namespace sls::worlds {

/// Flies `scenario` in one process, for comparison; a fleet also in two parts.
FlownScenario fly(const config::Scenario& scenario);

/// The scenarios of the worlds: one to three vehicles, both modes, all policies. About 300 steps
/// each. Some have faults, sensing or several stages; the flights of the last ones fail.
std::vector<FlownScenario> make_scenarios();

}  // namespace sls::worlds
