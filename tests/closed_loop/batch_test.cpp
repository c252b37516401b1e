// Compares a batch with flights under a controller: the same forces give the same bits.
#include "closed_loop/batch.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "closed_loop/flight.hpp"
#include "common/config/scenario_draft.hpp"
#include "tests/closed_loop/support.hpp"

namespace sls::closed_loop::test {
namespace {

using Eigen::Vector3d;
using Forces = LoopStates::Vectors;

config::Scenario load_analytic(const std::string& name) {
  config::Scenario scenario = load(name);
  scenario.plant.model.name = "analytic";
  scenario.plant.own = {};
  return scenario;
}

Forces repeat(const Vector3d& force, std::size_t count) {
  return force.transpose().replicate(static_cast<Eigen::Index>(count), 1);
}

void expect_row(const LoopStates& states, Eigen::Index row, const model::Measurement& state) {
  ASSERT_EQ(Vector3d(states.quad_position.row(row)), state.p_WQ);
  ASSERT_EQ(Vector3d(states.quad_velocity.row(row)), state.v_WQ);
  ASSERT_EQ(Vector3d(states.load_position.row(row)), state.p_WL);
  ASSERT_EQ(Vector3d(states.load_velocity.row(row)), state.v_WL);
  ASSERT_EQ(states.angles(row, 0), state.rod.alpha);
  ASSERT_EQ(states.angles(row, 1), state.rod.beta);
  ASSERT_EQ(states.angle_rates(row, 0), state.rod.alpha_dot);
  ASSERT_EQ(states.angle_rates(row, 1), state.rod.beta_dot);
  if (states.attitude.rows() == 0) return;
  ASSERT_EQ(states.attitude(row, 0), state.attitude.q_WB.w());
  ASSERT_EQ(states.attitude(row, 3), state.attitude.q_WB.z());
  ASSERT_EQ(Vector3d(states.body_rates.row(row)), state.attitude.w_WB_B);
}

/// Flies `scenario` and applies its forces to a batch of three on two threads; expects equal bits.
void expect_batch_equals_flight(const config::Scenario& scenario, std::uint32_t vehicle = 0) {
  constexpr std::size_t kCount = 3;
  constexpr std::uint64_t kSteps = 1500;
  BatchOptions options;
  options.vehicle = vehicle;
  options.threads = 2;
  Batch batch(scenario, kCount, options);
  Flight flight(scenario, vehicle);
  Vector3d answered = Vector3d::Zero();
  while (const model::StepRecord* flown = flight.fly_step()) {
    if (flown->step > 0) batch.step(repeat(answered, kCount).data());
    answered = flown->answer.f_Q_W;
    for (Eigen::Index i = 0; i < 3; ++i) {
      expect_row(batch.truth(), i, flown->truth);
      expect_row(batch.measured(), i, flown->seen());
    }
    ASSERT_EQ(batch.steps()[2], flown->step);
    ASSERT_EQ(batch.times()[2], static_cast<double>(flown->step * scenario.sync.period_ns) / 1e9);
    ASSERT_EQ(batch.can_measurement_differ(), flown->measured.has_value());
    if (flown->step == kSteps) break;
  }
  EXPECT_EQ(batch.has_failed(), std::vector<std::uint8_t>(kCount, 0));
}

TEST(BatchTest, UnderTheForcesOfAFlightItIsThatFlight) {
  for (const char* name : {"short", "figure_eight", "rotor_drag", "multirotor_figure_eight"}) {
    SCOPED_TRACE(name);
    expect_batch_equals_flight(load(name));
  }
  expect_batch_equals_flight(load_analytic("figure_eight"));
}

TEST(BatchTest, FaultsAndSensingActAsInAFlight) {
  expect_batch_equals_flight(load("faulty_figure_eight"));
  config::Scenario scenario = load_analytic("faulty_figure_eight");
  scenario.sensing = {{33'333'333, 20'000'000}, {20'000'000, 11'000'001}, 10'500'000};
  scenario.estimator.position << 0.02, -0.01, 0.03;
  expect_batch_equals_flight(scenario);
}

TEST(BatchTest, AVehicleOfAFleetFliesAsInItsFleet) {
  expect_batch_equals_flight(load("mixed_fleet"), 3);
}

TEST(BatchTest, ALibraryIsToldTheNumberOfItsVehicle) {
  config::ScenarioDraft draft(SLS_SOURCE_DIR "/config/scenarios/fleet.yaml");
  draft.set("plant", "{ model: " SLS_LIBRARIES
                     "/plant.so, step_s: 0.001, parameters: "
                     "{ in: advance, do: fail }, initial: { load_position_m: [0, 0, 0] } }");
  BatchOptions options;
  options.vehicle = 3;
  Batch batch(draft.make_scenario(), 1, options);
  batch.step(repeat(Vector3d(0, 0, -16), 1).data());
  EXPECT_EQ(batch.failure(0),
            SLS_LIBRARIES "/plant.so: advance, vehicle 3, step 0: the rope is torn");
}

/// Forces that differ from loop to loop and from step to step.
Forces make_forces(std::size_t count, int step) {
  Forces forces(static_cast<Eigen::Index>(count), 3);
  for (Eigen::Index i = 0; i < forces.rows(); ++i)
    forces.row(i) << std::sin(0.01 * step + 0.1 * static_cast<double>(i)),
        std::cos(0.02 * step - 0.2 * static_cast<double>(i)), -16.66;
  return forces;
}

TEST(BatchTest, TheNumberOfThreadsChangesNoBit) {
  const config::Scenario scenario = load_analytic("faulty_figure_eight");
  constexpr std::size_t kCount = 133;  // not a multiple of the block size
  BatchOptions options;
  Batch one(scenario, kCount, options);
  for (const std::size_t threads : {2, 3, 7}) {
    options.threads = threads;
    Batch several(scenario, kCount, options);
    for (int step = 0; step < 200; ++step) {
      if (threads == 2) one.step(make_forces(kCount, step).data());
      several.step(make_forces(kCount, step).data());
    }
    EXPECT_EQ(one.measured().load_position, several.measured().load_position);
    EXPECT_EQ(one.truth().angle_rates, several.truth().angle_rates);
  }
}

TEST(BatchTest, AFreeVehicleFallsAsFarAsGravitySays) {
  Batch batch(load_analytic("figure_eight"), 2);
  const Vector3d start = batch.truth().load_position.row(1);
  for (int step = 0; step < 250; ++step) batch.step(repeat(Vector3d::Zero(), 2).data());
  const Vector3d way = Vector3d(batch.truth().load_position.row(1)) - start;
  EXPECT_NEAR(way.z(), 0.5 * 9.8, 1e-9);  // 1 s; exact for a method of fourth order
  EXPECT_EQ(way.x(), 0.0);
}

TEST(BatchTest, ALoopThatFailsStaysStillUntilItsResetAndTheOthersGoOn) {
  const config::Scenario scenario = load_analytic("figure_eight");
  Batch batch(scenario, 3), undisturbed(scenario, 3);
  const Forces good = make_forces(3, 0);
  batch.step(good.data());
  const LoopStates before = batch.truth();
  Forces bad = good;
  bad(0, 1) = std::numeric_limits<double>::quiet_NaN();
  bad.row(2) << 0, 0, -201;
  batch.step(bad.data());
  for (int step = 0; step < 2; ++step) undisturbed.step(good.data());

  EXPECT_EQ(batch.has_failed(), (std::vector<std::uint8_t>{1, 0, 1}));
  EXPECT_EQ(batch.failure(0),
            "controller 'python' answered step 1 with a number that is not finite");
  EXPECT_EQ(batch.failure(1), "");
  EXPECT_EQ(batch.failure(2),
            "controller 'python' answered step 1 with a force beyond controller.force_limit_n: "
            "201 N > 200 N");
  batch.step(good.data());
  undisturbed.step(good.data());
  EXPECT_EQ(batch.truth().load_position.row(0), before.load_position.row(0));
  EXPECT_EQ(batch.truth().load_position.row(1), undisturbed.truth().load_position.row(1));
  EXPECT_EQ(batch.steps(), (std::vector<std::uint64_t>{1, 3, 1}));

  batch.reset({2}, {{scenario.plant.initial}});
  EXPECT_EQ(batch.has_failed(), (std::vector<std::uint8_t>{1, 0, 0}));
  EXPECT_EQ(batch.failure(2), "");
  batch.step(good.data());
  EXPECT_EQ(batch.truth().load_position.row(2), before.load_position.row(2));
}

TEST(BatchTest, APlantThatCannotGoOnIsNamedWithItsQuantity) {
  config::Scenario scenario = load("figure_eight");
  scenario.controller.force_limit_n = 1e300;
  Batch batch(scenario, 2);
  Forces forces(2, 3);
  forces << 0, 0, -16.66, 1e200, 0, 0;
  for (int step = 0; step < 5; ++step) batch.step(forces.data());
  EXPECT_EQ(batch.has_failed()[1], 1);
  EXPECT_NE(batch.failure(1).find(" is not finite after step "), std::string::npos)
      << batch.failure(1);
  EXPECT_TRUE(batch.truth().load_position.allFinite());
}

TEST(BatchTest, AResetBeginsWhereItSaysWithTheSeedsItSays) {
  config::Scenario scenario = load_analytic("figure_eight");
  config::NoiseFault noise;
  noise.deviation.position << 0.1, 0.1, 0.1;
  noise.seed = 7;
  scenario.faults = {make_fault(config::FaultChannel::kState, noise)};
  Batch batch(scenario, 3);
  LoopStart start{scenario.plant.initial};
  start.initial.placed = config::Body::kQuadrotor;
  start.initial.position << 1, 2, -3;
  start.initial.rod.alpha = 0.3;
  start.seed_shift = 5;
  batch.reset({1}, {start});

  std::get<config::NoiseFault>(scenario.faults[0].effect).seed = 12;
  scenario.plant.initial = start.initial;
  Batch other(scenario, 1);
  const Forces forces = make_forces(3, 0);
  for (int step = 0; step < 5; ++step) {
    batch.step(forces.data());
    other.step(forces.data() + 3);
    EXPECT_EQ(batch.measured().quad_position.row(1), other.measured().quad_position.row(0));
    EXPECT_NE(batch.measured().quad_position.row(0), batch.measured().quad_position.row(1));
  }
}

TEST(BatchTest, AResetThatIsRefusedChangesNothing) {
  const config::Scenario scenario = load_analytic("figure_eight");
  Batch batch(scenario, 2);
  batch.step(make_forces(2, 0).data());
  LoopStart turned{scenario.plant.initial};
  turned.initial.q_WB = Eigen::Quaterniond::Identity();
  EXPECT_THROW(batch.reset({0, 1}, {{scenario.plant.initial}, turned}), config::ConfigError);
  EXPECT_EQ(batch.steps(), (std::vector<std::uint64_t>{1, 1}));
}

TEST(BatchTest, TheReferenceIsThatOfTheFlight) {
  for (const char* name : {"figure_eight", "mission"}) {
    SCOPED_TRACE(name);
    const config::Scenario scenario = load(name);
    const Batch batch(scenario, 1);
    Flight flight(scenario);
    while (const model::StepRecord* flown = flight.fly_step()) {
      if (!std::holds_alternative<config::LeaveAfter>(scenario.mission[flown->answer.stage].leave))
        break;  // the later references depend on the flight
      const auto time_ns = static_cast<std::int64_t>(flown->step) * scenario.sync.period_ns;
      const model::Reference reference = batch.calc_reference(time_ns);
      ASSERT_EQ(reference.position, flown->answer.reference.position) << flown->step;
      ASSERT_EQ(reference.snap, flown->answer.reference.snap) << flown->step;
    }
  }
}

}  // namespace
}  // namespace sls::closed_loop::test
