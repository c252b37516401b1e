// Compares the flight in one process, bit for bit, with a second implementation of the programs'
// loop, in which a delay is a queue.
#include "closed_loop/flight.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <deque>

#include "sim_server/plants/cables/keys.hpp"
#include "sim_server/plants/slung_load/slung_load_plant.hpp"
#include "tests/closed_loop/support.hpp"

namespace sls::closed_loop::test {
namespace {

using Eigen::Vector3d;

/// States of the plant at every step. The force answered at a step acts `periods` later; until
/// then the first force acts.
std::vector<model::SlungLoadState> fly_by_hand(const config::Scenario& scenario, int periods) {
  sim::SlungLoadPlant plant(scenario.vehicle, scenario.plant);
  const control::FlightController controller(scenario);
  model::ControllerMemory memory;
  std::deque<Vector3d> under_way;
  std::vector<model::SlungLoadState> states;
  for (std::uint64_t step = 0;; ++step) {
    states.push_back(plant.state());
    const model::Answer answer = controller.calc_answer(step, plant.state(), memory);
    if (answer.mission != control::MissionPhase::kRunning) return states;
    memory = answer.memory;
    if (under_way.empty()) under_way.assign(static_cast<std::size_t>(periods), answer.f_Q_W);
    under_way.push_back(answer.f_Q_W);
    const Vector3d force = under_way.front();
    under_way.pop_front();
    for (std::int64_t t = 0; t < scenario.sync.period_ns; t += scenario.plant.step_ns)
      plant.step(force);
    if (periods == 0) under_way.clear();
  }
}

void expect_equal_runs(const std::vector<model::StepRecord>& flight,
                       const std::vector<model::SlungLoadState>& states) {
  ASSERT_EQ(flight.size(), states.size());
  for (std::size_t k = 0; k < states.size(); ++k) {
    SCOPED_TRACE(k);
    ASSERT_EQ(flight[k].step, k);
    expect_equal_bits(flight[k].truth, states[k]);
    if (testing::Test::HasFatalFailure()) return;
  }
}

TEST(FlightTest, WithoutFaultsItIsTheLoopOfControllerAndPlant) {
  for (const char* name : {"short", "matlab_setpoint_1", "rest_to_rest"}) {
    SCOPED_TRACE(name);
    const config::Scenario scenario = load(name);
    expect_equal_runs(fly(scenario), fly_by_hand(scenario, 0));
  }
}

TEST(FlightTest, AVehicleOfAFleetFliesItsOwnScenario) {
  const config::Scenario fleet = load("mixed_fleet");
  for (const std::uint32_t id : {0u, 3u})
    expect_equal_runs(fly(fleet, id), fly_by_hand(config::make_vehicle_scenario(fleet, id), 0));
}

TEST(FlightTest, ADelayOfNothingChangesNoBit) {
  const config::Scenario scenario = load("short");
  expect_equal_runs(fly(delay_command(scenario, 0)), fly_by_hand(scenario, 0));
}

TEST(FlightTest, ADelayedCommandIsAQueueOfForces) {
  const config::Scenario scenario = load("short");
  for (const int periods : {1, 5, 40})
    expect_equal_runs(fly(delay_command(scenario, periods)), fly_by_hand(scenario, periods));
}

TEST(FlightTest, AFlightRepeatsExactlyWithFaultsOfEveryKind) {
  const config::Scenario scenario = load("faulty_figure_eight");
  std::vector<model::SlungLoadState> states;
  for (const model::StepRecord& step : fly(scenario)) states.push_back(step.truth);
  expect_equal_runs(fly(scenario), states);
}

TEST(FlightTest, TheShippedFaultsAreMildEnoughToFinish) {
  Flight flight(load("faulty_figure_eight"));
  double worst = 0.0;
  std::uint64_t last = 0;
  while (const auto step = flight.fly_step()) {
    worst = std::max(worst, (step->truth.p_WL - step->answer.reference.position).norm());
    last = step->step;
  }
  EXPECT_EQ(flight.failure(), "");
  EXPECT_EQ(last, 8000u);  // 32 s at 4 ms
  EXPECT_LT(worst, 0.3);
  EXPECT_GT(worst, 0.05) << "the faults have no effect";
}

TEST(FlightTest, ControllerAnswersItsMeasurementAndStepsHoldTheForceThatActed) {
  config::Scenario scenario = load("short");
  config::BiasFault position, force;
  position.offset.position << 0.1, 0.0, 0.0;
  force.offset.force << 0.0, 0.5, 0.0;
  scenario.faults = {make_fault(config::FaultChannel::kState, position),
                     make_fault(config::FaultChannel::kCommand, force)};
  const auto flight = fly(scenario);
  const control::FlightController controller(scenario);
  EXPECT_EQ(flight[0].f_Q_W, Vector3d(0, 0, 0));
  for (std::size_t k = 1; k < flight.size(); ++k) {
    ASSERT_EQ(flight[k].seen().p_WL, Vector3d(flight[k].truth.p_WL + position.offset.position));
    ASSERT_EQ(flight[k].f_Q_W, Vector3d(flight[k - 1].answer.f_Q_W + force.offset.force));
    const auto answer = controller.calc_answer(k, flight[k].seen(), flight[k - 1].answer.memory);
    ASSERT_EQ(flight[k].answer.f_Q_W, answer.f_Q_W);
  }
}

/// Flies to the end. @returns the number of steps and the reason for the failure.
std::pair<std::size_t, std::string> find_failure(const config::Scenario& scenario) {
  Flight flight(scenario);
  std::size_t steps = 0;
  while (flight.fly_step()) ++steps;
  EXPECT_FALSE(flight.fly_step()) << "a flight that has ended goes on";
  return {steps, flight.failure()};
}

TEST(FlightTest, FailsWhereTheServerEndsTheRun) {
  using Failure = std::pair<std::size_t, std::string>;
  EXPECT_EQ(find_failure(load("short")), Failure(501, ""));

  config::Scenario weak = load("matlab_setpoint_3");  // its first step needs 116 N
  weak.controller.force_limit_n = 100.0;
  EXPECT_EQ(find_failure(weak), Failure(1,
                                        "controller 'control_client' answered step 0 with a force "
                                        "beyond controller.force_limit_n: 116.04 N > 100 N"));

  config::Scenario falling = load("short");
  falling.mission[0].reference = config::ConstantReference{{0.0, 0.0, 100.0}};
  EXPECT_EQ(find_failure(falling), Failure(1,
                                           "controller 'control_client' answered step 0 with a "
                                           "fault: free_fall"));

  config::Scenario late = load("short");
  config::LeaveUntil never;
  never.radius_m = 1e-9;
  never.timeout_ns = 400'000'000;
  late.mission[0].leave = never;
  EXPECT_EQ(find_failure(late), Failure(101,
                                        "controller 'control_client' answered step 100 "
                                        "with a fault: stage_timeout"));

  config::Scenario torn = load("short");
  config::BiasFault force;
  force.offset.force << 1e308, 0.0, 0.0;
  torn.faults = {make_fault(config::FaultChannel::kCommand, force)};
  const auto [steps, cause] = find_failure(torn);
  EXPECT_EQ(steps, 1u);
  EXPECT_NE(cause.find("is not finite"), std::string::npos) << cause;
}

TEST(FlightTest, ThreeVehiclesTurnTheirLoadToASuddenAttitudeFromAnyDirectionOfTheirCables) {
  config::Scenario scenario = load("three_carry_a_triangle_pose");
  for (auto& cable : scenario.plant.own.edit<sim::CablesKeys>().cables)
    cable.alpha = cable.beta = 0.0;  // instead of spread
  config::ConstantReference hold{Vector3d(0.0, 0.0, -1.0)};
  hold.attitude = Vector3d(0.4, 0.3, 1.0);
  scenario.mission.resize(1);
  scenario.mission[0].reference = hold;
  scenario.mission[0].leave = config::LeaveAfter{12'000'000'000};
  Flight flight(scenario, {0, 1, 2});
  const std::vector<sim::Signal> signals = flight.plant().signals();
  for (const auto& [place, name] : {std::pair{model::SharedLoad::kTension, "cable_tension_n"},
                                    std::pair{model::SharedLoad::kLength, "cable_length_m"},
                                    std::pair{model::SharedLoad::kTaut, "cable_taut"},
                                    std::pair{model::SharedLoad::kAttitude, "load_att_w"},
                                    std::pair{model::SharedLoad::kRates, "load_rate_x_rad_s"}})
    EXPECT_EQ(signals.at(place).name, name);
  while (flight.fly_step())
    for (const model::StepRecord& step : flight.steps())
      ASSERT_EQ(step.truth.signals[model::SharedLoad::kTaut], 1.0) << step.step;
  EXPECT_EQ(flight.failure(), "");
  const Eigen::Quaterniond wanted = Eigen::AngleAxisd(1.0, Vector3d::UnitZ()) *
                                    Eigen::AngleAxisd(0.3, Vector3d::UnitY()) *
                                    Eigen::AngleAxisd(0.4, Vector3d::UnitX());
  for (const model::StepRecord& step : flight.steps()) {
    const auto q = step.truth.signals.segment<4>(model::SharedLoad::kAttitude);
    // The double pole at -3 leaves 1.05 rad · 37 · exp(-36) after 12 s; that at -2 12 mm · 25 ·
    // exp(-24).
    EXPECT_LE(wanted.angularDistance(Eigen::Quaterniond(q[0], q[1], q[2], q[3])), 1e-7);
    const Vector3d& end =
        scenario.plant.own.get<sim::CablesKeys>().cables[step.vehicle_id].attachment;
    EXPECT_LE((step.truth.p_WL - Vector3d(0.0, 0.0, -1.0) - wanted * end).norm(), 1e-7);
  }
}

}  // namespace
}  // namespace sls::closed_loop::test
