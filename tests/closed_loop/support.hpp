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

/// `scenario` with the commands of a vehicle delayed for the whole flight.
inline config::Scenario delay_command(config::Scenario scenario, std::int64_t periods,
                                      int vehicle = 0) {
  scenario.faults.push_back(make_fault(config::FaultChannel::kCommand,
                                       config::DelayFault{periods * scenario.sync.period_ns}));
  scenario.faults.back().vehicle = vehicle;
  return scenario;
}

/// Three vehicles that hold a triangle 0.1 m beside its start for 4 s, law `cooperative`.
inline config::Scenario load_short_team() {
  config::Scenario scenario = load("three_carry_a_triangle_pose");
  scenario.mission.resize(1);
  scenario.mission[0].reference = config::ConstantReference{{0.1, 0.0, -1.0}, {}};
  scenario.mission[0].leave = config::LeaveAfter{4'000'000'000};
  return scenario;
}

}  // namespace sls::closed_loop::test
