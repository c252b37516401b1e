// Compares the margin with flights at every shorter delay and, for small motions about hover, with
// linear theory.
#include "closed_loop/delay_margin.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <complex>

#include "closed_loop/flight.hpp"
#include "tests/closed_loop/support.hpp"
#include "tests/support/errors.hpp"

namespace sls::closed_loop::test {
namespace {

/// Delay at which small horizontal motions about hover neither grow nor decay, s.
/// Plant: ÿ = −g β, m L β̈ = −(m + m_L) g β − F.
/// Law: F = −(m + m_L) g β + m L n / g, n = −k_j y⁽³⁾ − k_a ÿ − k_v ẏ − k_p y.
/// With F delayed by τ the characteristic equation is
///   s⁴ + ω² s² + e^(−sτ) (k_j s³ + (k_a − ω²) s² + k_v s + k_p) = 0,   ω² = (m + m_L) g / (m L).
/// For s = iw the quotient of both parts has magnitude 1, and the delay turns it to −1.
double calc_critical_delay(const model::SlungLoadParameters& vehicle) {
  // LQR with q = 10 on a chain of four: design, section 4.
  constexpr double kPosition = 3.1623, kVelocity = 8.4827, kAcceleration = 9.7962, kJerk = 5.4399;
  const double omega_2 =
      vehicle.total_mass() * vehicle.gravity / (vehicle.quad_mass * vehicle.rod_length);
  const auto calc_loop = [&](double w) {
    const std::complex<double> s(0.0, w);
    return (kJerk * s * s * s + (kAcceleration - omega_2) * s * s + kVelocity * s + kPosition) /
           (s * s * (s * s + omega_2));
  };
  double least = 1e9;
  for (double w = 0.01; w < 50.0; w += 1e-3) {
    if ((std::abs(calc_loop(w)) - 1.0) * (std::abs(calc_loop(w + 1e-3)) - 1.0) > 0.0) continue;
    const double turn = std::fmod(std::arg(calc_loop(w)) + 3.0 * M_PI, 2.0 * M_PI);
    least = std::min(least, turn / w);
  }
  return least;
}

/// Largest load error during [from, to) s.
double calc_worst_error(const std::vector<model::StepRecord>& flight, double from, double to) {
  double worst = 0.0;
  for (const model::StepRecord& step : flight) {
    const double time = 0.004 * static_cast<double>(step.step);
    if (time >= from && time < to)
      worst = std::max(worst, (step.truth.p_WL - step.answer.reference.position).norm());
  }
  return worst;
}

TEST(DelayMarginTest, TheScenariosOwnDelayIsAddedInAnotherLine) {
  DelayMargin margin;
  margin.period_ns = 4'000'000;
  margin.flights.resize(2);
  margin.flights[0].periods = 44;
  margin.flights[1].periods = 45;
  margin.flights[1].loss = "far away";
  const std::string alone = "held\n", line = "holds with 0.176 s, loses the load with 0.18 s\n";
  const auto ends_with = [&](const std::string& end) {
    const std::string text = to_text(margin);
    return text.size() > end.size() && text.substr(text.size() - end.size()) == end;
  };
  EXPECT_TRUE(ends_with("far away\n" + line)) << to_text(margin);
  margin.own_ns = 100'000'000;
  EXPECT_TRUE(ends_with(line + "with the scenario's own delay of 0.1 s: holds with 0.276 s, loses "
                               "the load with 0.28 s\n"))
      << to_text(margin);
}

TEST(DelayMarginTest, OnlyDelaysOfTheWholeFlightAreTheScenariosOwn) {
  config::Scenario scenario = load("short");
  const auto add = [&](config::FaultChannel on, std::int64_t by_ns, std::int64_t from_ns) {
    config::Fault fault;
    fault.kind = "delay";
    fault.on = on;
    fault.effect = config::DelayFault{by_ns};
    fault.from_ns = from_ns;
    scenario.faults.push_back(fault);
  };
  add(config::FaultChannel::kCommand, 8'000'000, 0);
  add(config::FaultChannel::kState, 4'000'000, 0);
  add(config::FaultChannel::kCommand, 4'000'000, 1'000'000'000);
  scenario.sensing.node_delay_ns = 1'000'000;
  EXPECT_EQ(find_delay_margin(scenario).own_ns, 13'000'000);
}

TEST(DelayMarginTest, SmallMotionsAboutHoverGrowFromTheDelayOfLinearTheoryOn) {
  config::Scenario scenario = load("figure_eight");
  scenario.plant.initial.position << 1e-6, 0.0, -0.5;  // so small that the motion stays linear
  scenario.mission[0].reference = config::ConstantReference{{0.0, 0.0, -0.5}};
  // The other motions at the start of the flight have decayed by 20 s.
  scenario.mission[0].leave = config::LeaveAfter{60'000'000'000};
  // The hold over one period adds a delay of half a period on average.
  const double critical = calc_critical_delay(scenario.vehicle) - 0.002;
  const auto periods = static_cast<std::int64_t>(critical / 0.004);
  ASSERT_EQ(periods, 57) << critical;  // 0.232 s
  const auto calc_growth = [&](std::int64_t delay) {
    const auto flight = fly(delay_command(scenario, delay));
    return calc_worst_error(flight, 40.0, 60.0) / calc_worst_error(flight, 20.0, 40.0);
  };
  EXPECT_LT(calc_growth(periods), 1.0);
  // Two periods more, not one: the hold delays by half a period to first order only.
  EXPECT_GT(calc_growth(periods + 2), 1.0);
}

TEST(DelayMarginTest, EveryShorterDelayHoldsAndTheNextOneDoesNot) {
  const config::Scenario scenario = load("matlab_setpoint_3");
  const DelayMargin margin = find_delay_margin(scenario);
  ASSERT_NE(margin.shortest_lost(), nullptr);
  const std::int64_t lost = margin.shortest_lost()->periods;
  EXPECT_EQ(margin.longest_held()->periods, lost - 1);
  ASSERT_LT(lost, 20) << "flying every delay would take long";
  for (std::int64_t periods = 0; periods <= lost; ++periods) {
    Flight flight(delay_command(scenario, periods));
    while (flight.fly_step()) continue;
    EXPECT_EQ(flight.failure().empty(), periods < lost) << periods;
  }
}

/// True if a flight of all vehicles ends without a failure.
bool holds(const config::Scenario& scenario) {
  Flight flight(scenario, list_vehicles(scenario));
  while (flight.fly_step()) continue;
  return flight.failure().empty();
}

TEST(DelayMarginTest, OfAGroupAllVehiclesOrOneAreDelayed) {
  const config::Scenario team = load_short_team();
  for (const std::optional<std::uint32_t> only : {std::optional<std::uint32_t>(), {2}}) {
    const auto delay = [&](std::int64_t periods) {
      if (only) return delay_command(team, periods, static_cast<int>(*only));
      config::Scenario delayed = team;
      for (int i = 0; i < 3; ++i) delayed = delay_command(delayed, periods, i);
      return delayed;
    };
    const DelayMargin margin = find_delay_margin(team, only);
    ASSERT_NE(margin.shortest_lost(), nullptr);
    const std::int64_t lost = margin.shortest_lost()->periods;
    EXPECT_EQ(margin.longest_held()->periods, lost - 1);
    EXPECT_TRUE(holds(delay(lost - 1))) << lost;
    EXPECT_FALSE(holds(delay(lost))) << lost;
    EXPECT_EQ(margin.shortest_lost()->loss.rfind("vehicle ", 0), 0u) << to_text(margin);
  }
}

TEST(DelayMarginTest, OtherVehiclesOfAFleetDoNotMatter) {
  config::Scenario fleet = load("mixed_fleet");
  fleet.plant.model.name = "analytic";
  fleet.plant.own = {};
  const DelayMargin in_fleet = find_delay_margin(fleet, 3);
  fleet.vehicles = {fleet.vehicles[3]};
  const DelayMargin alone = find_delay_margin(fleet);
  ASSERT_NE(alone.shortest_lost(), nullptr);
  EXPECT_EQ(in_fleet.shortest_lost()->periods, alone.shortest_lost()->periods);
  EXPECT_EQ(in_fleet.shortest_lost()->loss, "vehicle 3: " + alone.shortest_lost()->loss);
}

TEST(DelayMarginTest, VehiclesThatDifferInTheirOwnDelayHaveNoCommonOne) {
  const config::Scenario team = delay_command(load_short_team(), 2, 1);
  EXPECT_EQ(find_delay_margin(team).own_ns, 0);
  EXPECT_EQ(find_delay_margin(team, 1).own_ns, 8'000'000);
  EXPECT_EQ(find_delay_margin(team, 0).own_ns, 0);
}

TEST(DelayMarginTest, AVehicleThatIsNotThereIsRefused) {
  EXPECT_EQ(
      sls::test::find_error<config::ConfigError>([] { find_delay_margin(load_short_team(), 3); }),
      "--vehicle: expected one of three_carry_a_triangle_pose, 0 to 2, got 3");
}

TEST(DelayMarginTest, TheScenariosOwnDelayIsPartOfIt) {
  const config::Scenario scenario = load("matlab_setpoint_3");
  const auto without = find_delay_margin(scenario);
  const auto with = find_delay_margin(delay_command(scenario, 2));
  EXPECT_EQ(with.shortest_lost()->periods, without.shortest_lost()->periods - 2);
}

TEST(DelayMarginTest, LosesTheLoadWhenItIsARodsLengthFurtherAwayThanWithoutDelay) {
  // With a delay of 0.26 s the figure eight ends in bounded oscillations without a fault.
  const config::Scenario scenario = load("figure_eight");
  const auto undelayed = fly(scenario), delayed = fly(delay_command(scenario, 65));
  ASSERT_EQ(undelayed.size(), delayed.size());
  const auto calc_error = [](const model::StepRecord& step) {
    return (step.truth.p_WL - step.answer.reference.position).norm();
  };
  std::size_t lost = 0;
  while (calc_error(delayed[lost]) - calc_error(undelayed[lost]) <= 1.0)
    ASSERT_LT(++lost, delayed.size());

  const DelayMargin margin = find_delay_margin(scenario);
  EXPECT_EQ(margin.longest_held()->periods, 64);
  const DelayedFlight& flight = *margin.shortest_lost();
  EXPECT_EQ(flight.periods, 65);
  EXPECT_EQ(flight.worst_error, calc_error(delayed[lost]));
  EXPECT_EQ(std::lround(std::stod(flight.loss.substr(flight.loss.find(", at ") + 5)) / 0.004),
            static_cast<long>(lost))
      << flight.loss;
}

TEST(DelayMarginTest, LosesTheLoadByTheRodOfTheVehicleNotOfItsTemplate) {
  config::Scenario own = load("figure_eight");
  own.plant.model.name = "analytic";
  own.plant.own = {};
  config::Scenario varied = own;
  own.vehicle.rod_length = own.controller.model.vehicle.rod_length = 0.5;
  varied.vehicles[0].rod_length = 0.5;
  const std::string table = to_text(find_delay_margin(own));
  EXPECT_NE(table.find("load more than 0.5 m"), table.npos) << table;
  EXPECT_EQ(to_text(find_delay_margin(varied)), table);
}

TEST(DelayMarginTest, RepeatsExactlyAndListsFlightsInOrderOfDelay) {
  const config::Scenario scenario = load("matlab_setpoint_3");
  const DelayMargin margin = find_delay_margin(scenario);
  EXPECT_EQ(to_text(margin), to_text(find_delay_margin(scenario)));
  for (std::size_t i = 1; i < margin.flights.size(); ++i)
    EXPECT_LT(margin.flights[i - 1].periods, margin.flights[i].periods);
  EXPECT_EQ(margin.flights.front().periods, 0);
}

TEST(DelayMarginTest, ErrorsAreThoseOfTheFlight) {
  const config::Scenario scenario = load("short");
  const auto flight = fly(delay_command(scenario, 4));
  double worst = 0.0, sum = 0.0;
  for (const model::StepRecord& step : flight) {
    const double error = (step.truth.p_WL - step.answer.reference.position).norm();
    worst = std::max(worst, error);
    sum += error * error;
  }
  const DelayMargin margin = find_delay_margin(scenario);
  ASSERT_EQ(margin.flights.at(3).periods, 4);
  EXPECT_EQ(margin.flights[3].worst_error, worst);
  EXPECT_EQ(margin.flights[3].rms_error, std::sqrt(sum / static_cast<double>(flight.size())));
}

TEST(DelayMarginTest, ReportsALoadThatIsNeverLost) {
  // The flight lasts two seconds: the force held from the start does not lose the load.
  const DelayMargin margin = find_delay_margin(load("short"));
  EXPECT_EQ(margin.shortest_lost(), nullptr);
  EXPECT_EQ(margin.longest_held()->periods, 2500);
  const std::string text = to_text(margin);
  EXPECT_NE(text.find("\nholds with 10 s, the longest delay tried: the load was never lost\n"),
            std::string::npos)
      << text;
}

TEST(DelayMarginTest, AScenarioThatLosesTheLoadAnywayIsAnError) {
  config::Scenario scenario = load("matlab_setpoint_3");
  scenario.controller.force_limit_n = 100.0;
  EXPECT_EQ(sls::test::find_error<std::runtime_error>([&] { find_delay_margin(scenario); }),
            "the load is lost without any added delay: controller 'control_client' answered step 0 "
            "with a force beyond controller.force_limit_n: 116.04 N > 100 N, at 0 s");
}

}  // namespace
}  // namespace sls::closed_loop::test
