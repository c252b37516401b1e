/// Shared by the tests of the closed loop in one process.
#pragma once

#include <gtest/gtest.h>

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

inline void expect_equal_bits(const model::SlungLoadState& a, const model::SlungLoadState& b) {
  ASSERT_EQ(a.p_WQ, b.p_WQ);
  ASSERT_EQ(a.v_WQ, b.v_WQ);
  ASSERT_EQ(a.p_WL, b.p_WL);
  ASSERT_EQ(a.v_WL, b.v_WL);
  ASSERT_EQ(a.rod.alpha, b.rod.alpha);
  ASSERT_EQ(a.rod.beta, b.rod.beta);
  ASSERT_EQ(a.rod.alpha_dot, b.rod.alpha_dot);
  ASSERT_EQ(a.rod.beta_dot, b.rod.beta_dot);
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
