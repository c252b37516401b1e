#pragma once

#include <string>
#include <vector>

#include "worlds/setting.hpp"

namespace sls::worlds {

/// Flies `scenario` in one process, for comparison.
/// @throws config::ConfigError if this flight fails: no world could finish it.
FlownScenario fly(const config::Scenario& scenario);

/// The scenarios of the worlds: one to three vehicles, both modes, all policies. 300 steps each.
std::vector<FlownScenario> make_scenarios();

}  // namespace sls::worlds
