/// Shared by the tests of the closed loop in one process.
#pragma once

#include <string>

#include "common/config/scenario.hpp"

namespace sls::closed_loop::test {

/// A shipped scenario by name.
inline config::Scenario load(const std::string& name) {
  return config::load_scenario(std::string(SLS_SOURCE_DIR) + "/config/scenarios/" + name + ".yaml");
}

inline config::Fault make_fault(config::FaultChannel on, const config::FaultEffect& effect) {
  config::Fault fault;
  fault.on = on;
  fault.effect = effect;
  return fault;
}

/// `scenario` with its command delayed for the whole flight.
inline config::Scenario delay_command(config::Scenario scenario, std::int64_t periods) {
  scenario.faults.push_back(make_fault(config::FaultChannel::kCommand,
                                       config::DelayFault{periods * scenario.sync.period_ns}));
  return scenario;
}

}  // namespace sls::closed_loop::test
