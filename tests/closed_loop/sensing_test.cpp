// Sensing in flight: ages and delays of whole control periods act like the same faults, and a
// vehicle of a fleet flies as it does alone.
#include <gtest/gtest.h>

#include "closed_loop/delay_margin.hpp"
#include "closed_loop/flight.hpp"
#include "tests/closed_loop/support.hpp"

namespace sls::closed_loop::test {
namespace {

using Eigen::Vector3d;

config::Scenario delay_node(config::Scenario scenario, std::int64_t periods) {
  scenario.sensing.node_delay_ns += periods * scenario.sync.period_ns;
  return scenario;
}

config::Scenario delay_state(config::Scenario scenario, std::int64_t periods) {
  scenario.faults.push_back(make_fault(config::FaultChannel::kState,
                                       config::DelayFault{periods * scenario.sync.period_ns}));
  return scenario;
}

config::Scenario age(config::Scenario scenario, std::int64_t periods) {
  const config::SampleTimes old{0, periods * scenario.sync.period_ns};
  scenario.sensing.body = scenario.sensing.rod = old;
  return scenario;
}

/// Times that fit neither plant step nor control period.
config::Scenario make_awkward(config::Scenario scenario) {
  scenario.sensing = {{33'333'333, 20'000'000}, {20'000'000, 11'000'001}, 10'500'000};
  scenario.estimator.position << 0.02, -0.01, 0.03;
  return scenario;
}

void expect_equal_flights(const std::vector<model::StepRecord>& a,
                          const std::vector<model::StepRecord>& b) {
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t k = 0; k < a.size(); ++k) {
    SCOPED_TRACE(k);
    expect_equal_bits(a[k].truth, b[k].truth);
    expect_equal_bits(a[k].seen(), b[k].seen());
    ASSERT_EQ(a[k].answer.f_Q_W, b[k].answer.f_Q_W);
  }
}

TEST(SensingTest, ANodeDelayOfWholePeriodsIsTheFaultDelayOnCommand) {
  for (const int periods : {1, 5, 40}) {
    const config::Scenario scenario = load("short");
    const auto node = fly(delay_node(scenario, periods));
    const auto fault = fly(delay_command(scenario, periods));
    expect_equal_flights(node, fault);
    for (std::size_t k = 1; k < node.size(); ++k) {
      EXPECT_FALSE(node[k].measured);
      // state.csv has the force before the delay of the node, but after the delay of the fault.
      ASSERT_EQ(node[k].f_Q_W, node[k - 1].answer.f_Q_W);
      const std::size_t answered = k - 1 < static_cast<std::size_t>(periods) ? 0 : k - 1 - periods;
      ASSERT_EQ(fault[k].f_Q_W, fault[answered].answer.f_Q_W);
    }
  }
}

TEST(SensingTest, AnAgeOfWholePeriodsIsTheFaultDelayOnState) {
  for (const int periods : {1, 5, 40}) {
    const config::Scenario scenario = load("short");
    const auto old = fly(age(scenario, periods)), delayed = fly(delay_state(scenario, periods));
    expect_equal_flights(old, delayed);
    for (std::size_t k = 0; k < old.size(); ++k) {
      EXPECT_TRUE(old[k].measured);
      ASSERT_EQ(old[k].f_Q_W, delayed[k].f_Q_W);
    }
  }
}

TEST(SensingTest, AnAgeRoundsUpToStepsOfThePlant) {
  config::Scenario scenario = load("short");
  config::Scenario rounded = scenario;
  scenario.sensing.body = scenario.sensing.rod = {0, 6'000'001};
  rounded.sensing.body = rounded.sensing.rod = {1'000'000, 7'000'000};
  expect_equal_flights(fly(scenario), fly(rounded));
}

TEST(SensingTest, TheEstimatorsErrorsAreTheFaultBiasOnState) {
  config::Scenario wrong = load("short"), biased = wrong;
  wrong.estimator.position << 0.05, -0.02, 0.1;
  wrong.estimator.velocity << -0.1, 0.2, 0.03;
  config::BiasFault bias;
  bias.offset.position = wrong.estimator.position;
  bias.offset.velocity = wrong.estimator.velocity;
  biased.faults.push_back(make_fault(config::FaultChannel::kState, bias));
  expect_equal_flights(fly(wrong), fly(biased));
}

TEST(SensingTest, FaultsActOnTheSensorsOutput) {
  config::Scenario scenario = age(load("short"), 3);
  config::BiasFault bias;
  bias.offset.position << 0.1, 0.0, 0.0;
  scenario.faults = {make_fault(config::FaultChannel::kState, bias)};
  const auto flight = fly(scenario);
  for (std::size_t k = 3; k < flight.size(); ++k)
    ASSERT_EQ(flight[k].seen().p_WL, Vector3d(flight[k - 3].truth.p_WL + bias.offset.position));
}

TEST(SensingTest, SamplesAtTheControlPeriodThatAreSeenAtOnceChangeNothing) {
  config::Scenario scenario = load("short");
  const auto plain = fly(scenario);
  scenario.sensing.body = {4'000'000, 0};
  scenario.sensing.rod = {500'000, 0};
  const auto sensed = fly(scenario);
  expect_equal_flights(plain, sensed);
  EXPECT_FALSE(sensed.front().measured);
}

TEST(SensingTest, AVehicleOfAFleetFliesAsItDoesAlone) {
  const config::Scenario fleet = make_awkward(load("mixed_fleet"));
  Flight together(fleet, {0, 1, 2, 3});
  std::vector<std::vector<model::StepRecord>> flown(4);
  while (together.fly_step())
    for (std::size_t i = 0; i < 4; ++i) flown[i].push_back(together.steps()[i]);
  EXPECT_EQ(together.failure(), "");
  for (const std::uint32_t id : {0u, 3u}) {
    auto alone = fly(fleet, id);
    ASSERT_LE(alone.size(), flown[id].size());
    flown[id].resize(alone.size());  // the fleet flies until its last vehicle finishes
    expect_equal_flights(alone, flown[id]);
  }
}

TEST(SensingTest, AFlightRepeatsExactlyAndItsAnswersArePure) {
  const config::Scenario scenario = make_awkward(load("faulty_figure_eight"));
  FlightOptions options;
  options.checks_purity = true;
  Flight flight(scenario, {0}, options);
  std::vector<model::StepRecord> checked;
  while (const model::StepRecord* step = flight.fly_step()) checked.push_back(*step);
  EXPECT_EQ(flight.failure(), "");
  expect_equal_flights(checked, fly(scenario));
}

TEST(SensingTest, TheDelayMarginCountsTheNodeDelay) {
  const config::Scenario scenario = load("matlab_setpoint_3");
  const auto without = find_delay_margin(scenario);
  const auto with = find_delay_margin(delay_node(scenario, 2));
  EXPECT_EQ(with.shortest_lost()->periods, without.shortest_lost()->periods - 2);
}

}  // namespace
}  // namespace sls::closed_loop::test
