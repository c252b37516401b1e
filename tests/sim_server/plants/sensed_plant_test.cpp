// Measurements, compared with the rules of the README (as loops over nanoseconds) and with flights
// that have closed-form states.
#include "sim_server/plants/sensing/sensed_plant.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <random>

#include "sim_server/plants/analytic/analytic_plant.hpp"
#include "sim_server/plants/sensing/sample_clock.hpp"
#include "sim_server/plants/sensing/sensor_group.hpp"
#include "tests/support/errors.hpp"

namespace sls::sim {
namespace {

using config::SampleTimes;
using Eigen::Vector3d;

constexpr std::int64_t kStepNs = 1'000'000;  // config::Plant's default
constexpr int kStepsPerPeriod = 4;           // config::Sync's default

/// The step that is measured at `step`. It is the last step up to the last sample time that is at
/// least `age_ns` ago; step 0, the initial state, before the first sample time.
std::int64_t find_seen_by_hand(const SampleTimes& times, std::int64_t step_ns, std::int64_t step) {
  const std::int64_t now = step * step_ns;
  const std::int64_t between = times.period_ns > 0 ? times.period_ns : step_ns;
  std::int64_t sample = 0;
  while (sample + between + times.age_ns <= now) sample += between;
  std::int64_t seen = 0;
  while ((seen + 1) * step_ns <= sample) ++seen;
  return seen;
}

/// Periods and ages that are no multiples of the step, and limiting cases.
const std::vector<SampleTimes> kTimes = {
    {0, 0},          {0, 1},           {0, 20'000'000},         {0, 20'000'001},
    {1'000'000, 0},  {4'000'000, 0},   {33'333'333, 0},         {33'333'333, 20'000'000},
    {20'000'000, 1}, {300'000, 0},     {300'000, 700'001},      {999'999, 3'000'000},
    {1'000'001, 0},  {7'000'000, 999}, {20'000'000, 47'000'003}};

TEST(SampleClockTest, ShowsTheLastStepOfTheLastSampleThatHasArrived) {
  for (const SampleTimes& times : kTimes)
    for (const std::int64_t step_ns : {1'000'000, 250'000, 333'333}) {
      const SampleClock clock(times, step_ns);
      for (std::int64_t step = 0; step < 400; ++step)
        ASSERT_EQ(clock.find_seen(step), find_seen_by_hand(times, step_ns, step))
            << times.period_ns << ' ' << times.age_ns << ' ' << step;
    }
}

TEST(SampleClockTest, SamplesAtEveryStepThatIsEverSeenLater) {
  for (const SampleTimes& times : kTimes) {
    const SampleClock clock(times, kStepNs);
    if (times.period_ns == 0 && times.age_ns == 0) {
      EXPECT_EQ(clock.find_next_sample(0), SampleClock::kNever);
      continue;
    }
    std::vector<bool> is_sampled(400);
    for (std::int64_t step = 0; step < 400; step = clock.find_next_sample(step))
      is_sampled[static_cast<std::size_t>(step)] = true;
    for (std::int64_t step = 0; step < 400; ++step)
      ASSERT_TRUE(is_sampled[static_cast<std::size_t>(clock.find_seen(step))]) << step;
  }
}

TEST(SampleClockTest, IsOldAtAControlPeriodUnlessItSamplesThereAndIsSeenAtOnce) {
  for (const SampleTimes& times : kTimes) {
    bool is_old = false;
    for (std::int64_t step = 0; step < 2000; step += kStepsPerPeriod)
      is_old = is_old || find_seen_by_hand(times, kStepNs, step) != step;
    EXPECT_EQ(is_ever_old(times, kStepsPerPeriod * kStepNs), is_old)
        << times.period_ns << ' ' << times.age_ns;
  }
}

// --- plants --------------------------------------------------------------------------------------

/// A plant in which every number encodes the step and the vehicle.
class Counter : public Plant {
 public:
  explicit Counter(std::size_t vehicles) : measurements_(vehicles) { measure(); }
  void advance(const std::vector<Vector3d>& f_Q_W, std::int64_t steps) override {
    for (std::int64_t i = 0; i < steps; ++i) acted.push_back(f_Q_W);
    step_ += steps;
    measure();
  }
  const model::Measurement& measurement(std::size_t vehicle) const override {
    return measurements_[vehicle];
  }
  bool has_attitude() const override { return true; }
  std::vector<Signal> signals() const override { return {{"count", ""}}; }

  std::vector<std::vector<Vector3d>> acted;  // forces in each step

 private:
  void measure() {
    for (std::size_t i = 0; i < measurements_.size(); ++i) {
      const double number = static_cast<double>(step_) + 1e6 * static_cast<double>(i);
      model::Measurement& now = measurements_[i];
      now = model::make_state({number, 0.0, 1.0}, {2.0 * number, 0.0, 0.0},
                              {1e-3 * static_cast<double>(step_), 0.2, 3.0 * number, 0.1}, 1.0);
      now.attitude.q_WB = Eigen::AngleAxisd(1e-3 * number, Vector3d(1, 2, 3).normalized());
      now.attitude.w_WB_B << number, 1.0, 2.0;
      now.signals.resize(1);
      now.signals[0] = number;
    }
  }

  std::int64_t step_ = 0;
  std::vector<model::Measurement> measurements_;
};

PlantSetup make_setup(const config::Scenario& scenario, std::size_t vehicles) {
  PlantSetup setup;
  setup.plant = scenario.plant;
  setup.estimator = scenario.estimator;
  setup.vehicles.resize(vehicles);
  return setup;
}

/// A counter behind the sensing of `scenario`.
struct SensedCounter {
  explicit SensedCounter(const config::Scenario& scenario, std::size_t vehicles = 1) {
    auto counting = std::make_unique<Counter>(vehicles);
    counter = counting.get();
    plant = make_sensed(std::move(counting), make_setup(scenario, vehicles), scenario);
  }
  Counter* counter;
  std::unique_ptr<Plant> plant;
};

config::Scenario make_scenario(const SampleTimes& body, const SampleTimes& rod,
                               std::int64_t node_delay_ns = 0) {
  config::Scenario scenario;
  scenario.sensing = {body, rod, node_delay_ns};
  return scenario;
}

void expect_equal_bits(const model::Measurement& a, const model::Measurement& b) {
  const auto bytes = [](const model::Measurement& m) {
    std::string text;
    const auto append = [&](const auto& vector) {
      text.append(reinterpret_cast<const char*>(vector.data()),
                  sizeof(double) * static_cast<std::size_t>(vector.size()));
    };
    for (const Vector3d& v : {m.p_WQ, m.v_WQ, m.p_WL, m.v_WL, m.attitude.w_WB_B}) append(v);
    append(m.attitude.q_WB.coeffs());
    append(m.signals);
    append(Eigen::Vector4d(m.rod.alpha, m.rod.beta, m.rod.alpha_dot, m.rod.beta_dot));
    return text;
  };
  ASSERT_EQ(bytes(a), bytes(b));
}

TEST(SensedPlantTest, ShowsBodyAndRodEachOfItsOwnStepInAnyCombinationOfTimes) {
  for (const SampleTimes& body : kTimes)
    for (const SampleTimes& rod : kTimes) {
      SensedCounter sensed(make_scenario(body, rod));
      for (std::int64_t step = 0; step < 300; step += kStepsPerPeriod) {
        const model::Measurement& seen = sensed.plant->seen(0);
        const auto body_step = static_cast<double>(find_seen_by_hand(body, kStepNs, step));
        const auto rod_step = static_cast<double>(find_seen_by_hand(rod, kStepNs, step));
        ASSERT_EQ(seen.p_WQ.x(), body_step) << step;
        ASSERT_EQ(seen.v_WQ.x(), 2.0 * body_step);
        ASSERT_EQ(seen.attitude.w_WB_B.x(), body_step);
        ASSERT_EQ(seen.signals[0], body_step);
        ASSERT_EQ(seen.rod.alpha, 1e-3 * rod_step);
        ASSERT_EQ(seen.rod.alpha_dot, 3.0 * rod_step);
        // The load follows from the rod at the rod's sample time and the quadrotor at the body's.
        const auto expected = model::make_state(seen.p_WQ, seen.v_WQ, seen.rod, 1.0);
        const double rounding = 1e-12;  // of numbers up to 1000
        ASSERT_LE((seen.p_WL - expected.p_WL).norm(), rounding);
        ASSERT_LE((seen.v_WL - expected.v_WL).norm(), rounding);
        ASSERT_EQ(sensed.plant->measurement(0).p_WQ.x(), static_cast<double>(step));
        sensed.plant->advance({Vector3d::Zero()}, kStepsPerPeriod);
      }
    }
}

TEST(SensedPlantTest, OfOneTimeEveryBitIsThatOfTheState) {
  const SampleTimes times{33'333'333, 20'000'000};
  SensedCounter sensed(make_scenario(times, times));
  std::vector<model::Measurement> truth;
  for (std::int64_t step = 0; step < 300; ++step) {
    truth.push_back(sensed.plant->measurement(0));
    expect_equal_bits(sensed.plant->seen(0),
                      truth[static_cast<std::size_t>(find_seen_by_hand(times, kStepNs, step))]);
    sensed.plant->advance({Vector3d::Zero()}, 1);
  }
}

TEST(SensedPlantTest, IsThePlantItselfWithoutSensingKeys) {
  const auto is_wrapped = [](const config::Scenario& scenario) {
    const SensedCounter sensed(scenario);
    return sensed.plant.get() != sensed.counter;
  };
  config::Scenario scenario;
  EXPECT_FALSE(is_wrapped(scenario));
  EXPECT_FALSE(is_wrapped(make_scenario({4'000'000, 0}, {1'000'000, 0})));
  EXPECT_TRUE(is_wrapped(make_scenario({}, {0, 1})));
  scenario.estimator.attitude.yaw = 1e-9;
  EXPECT_TRUE(is_wrapped(scenario));

  const SensedCounter late(make_scenario({}, {}, 1));
  EXPECT_NE(late.plant.get(), late.counter);
  EXPECT_TRUE(late.plant->sees_truth());
  EXPECT_FALSE(SensedCounter(make_scenario({}, {0, 1})).plant->sees_truth());
  EXPECT_TRUE(late.plant->has_attitude());
  EXPECT_EQ(late.plant->signals().front().name, "count");
}

TEST(SensedPlantTest, AddsTheEstimatorsErrorsToAllThatIsSeenAndNothingThatIsTrue) {
  config::Scenario scenario;
  scenario.estimator.position << 0.1, 0.2, 0.3;
  scenario.estimator.velocity << 0.4, 0.5, 0.6;
  scenario.estimator.attitude = {{0.3, -0.2}, 0.7};
  SensedCounter sensed(scenario);
  sensed.plant->advance({Vector3d::Zero()}, 8);
  const model::Measurement &truth = sensed.counter->measurement(0), &seen = sensed.plant->seen(0);
  expect_equal_bits(sensed.plant->measurement(0), truth);
  EXPECT_FALSE(sensed.plant->sees_truth());
  for (const Vector3d& moved : {Vector3d(seen.p_WQ - truth.p_WQ), Vector3d(seen.p_WL - truth.p_WL)})
    EXPECT_LE((moved - Vector3d(0.1, 0.2, 0.3)).norm(), 1e-14);
  for (const Vector3d& moved : {Vector3d(seen.v_WQ - truth.v_WQ), Vector3d(seen.v_WL - truth.v_WL)})
    EXPECT_LE((moved - Vector3d(0.4, 0.5, 0.6)).norm(), 1e-14);
  EXPECT_EQ(seen.rod.alpha, truth.rod.alpha);
  EXPECT_EQ(seen.attitude.w_WB_B, truth.attitude.w_WB_B);
  EXPECT_EQ(seen.signals, truth.signals);

  Eigen::Matrix3d x, y, z;
  x << 1, 0, 0, 0, std::cos(0.3), -std::sin(0.3), 0, std::sin(0.3), std::cos(0.3);
  y << std::cos(0.2), 0, -std::sin(0.2), 0, 1, 0, std::sin(0.2), 0, std::cos(0.2);
  z << std::cos(0.7), -std::sin(0.7), 0, std::sin(0.7), std::cos(0.7), 0, 0, 0, 1;
  const Eigen::Matrix3d expected = z * y * x * truth.attitude.q_WB.toRotationMatrix();
  EXPECT_LE((seen.attitude.q_WB.toRotationMatrix() - expected).norm(), 1e-14);
}

TEST(SensedPlantTest, AForceActsFromTheFirstStepNotBeforeItsArrivalAndTheFirstOneUntilThen) {
  for (const std::int64_t delay : {1, 500'000, 1'000'000, 2'500'000, 4'000'000, 9'999'999}) {
    SensedCounter sensed(make_scenario({}, {}, delay));
    for (int k = 0; k < 50; ++k) sensed.plant->advance({Vector3d(k, 0, 0)}, kStepsPerPeriod);
    const auto& acted = sensed.counter->acted;
    ASSERT_EQ(acted.size(), 200u);
    for (std::int64_t step = 0; step < 200; ++step) {
      int newest = 0;  // the first force acts until a force has arrived
      for (int k = 0; k < 50; ++k)
        if (k * kStepsPerPeriod * kStepNs + delay <= step * kStepNs) newest = k;
      ASSERT_EQ(acted[static_cast<std::size_t>(step)][0].x(), newest) << delay << ' ' << step;
    }
  }
}

TEST(SensedPlantTest, EveryVehicleOfAPlantOfAllHasItsOwnSamplesAndForces) {
  const SampleTimes body{33'333'333, 20'000'000}, rod{0, 7'000'000};
  config::Scenario scenario = make_scenario(body, rod, 2'500'000);
  SensedCounter sensed(scenario, 3);
  for (std::int64_t step = 0; step < 200; step += kStepsPerPeriod) {
    for (std::size_t i = 0; i < 3; ++i) {
      ASSERT_EQ(sensed.plant->seen(i).p_WQ.x(),
                static_cast<double>(find_seen_by_hand(body, kStepNs, step)) + 1e6 * i);
      ASSERT_EQ(sensed.plant->seen(i).rod.alpha_dot,
                3.0 * (static_cast<double>(find_seen_by_hand(rod, kStepNs, step)) + 1e6 * i));
    }
    sensed.plant->advance({Vector3d(step, 0, 0), Vector3d(0, step, 0), Vector3d(0, 0, step)},
                          kStepsPerPeriod);
  }
  for (const auto& forces : sensed.counter->acted) {
    EXPECT_EQ(forces[0].x(), forces[1].y());
    EXPECT_EQ(forces[0].x(), forces[2].z());
  }
  EXPECT_EQ(sensed.counter->acted[198][0].x(), 192);
  EXPECT_EQ(sensed.counter->acted[199][0].x(), 196);  // sent at step 196, delayed by 2.5 ms
}

TEST(SensorGroupTest, KeepsOnlySamplesUnderWay) {
  for (const SampleTimes& times : kTimes) {
    Counter plant(1);
    SensorGroup<model::Measurement> group(SampleClock(times, kStepNs), plant, 1);
    const std::int64_t between = std::max(times.period_ns, kStepNs);
    for (std::int64_t step = 1; step <= 20'000; ++step) {
      plant.advance({Vector3d::Zero()}, 1);
      group.sample(plant, step);
      // Samples on the way, the sample in use, and one that is due now.
      ASSERT_LE(static_cast<std::int64_t>(group.kept()), times.age_ns / between + 3);
    }
  }
}

TEST(DelayLineTest, KeepsTheSampleTakenLastAndThoseAfterIt) {
  DelayLine<std::int64_t> line;
  for (std::int64_t step = 0; step < 1000; ++step) {
    line.put(step, step);
    EXPECT_EQ(line.take(step - 7), std::max<std::int64_t>(step - 7, 0));
    EXPECT_LE(line.size(), 8u);
  }
}

// --- real plants ---------------------------------------------------------------------------------

config::Scenario make_flight(const config::Sensing& sensing) {
  config::Scenario scenario;
  scenario.plant.initial.position << 0.2, -0.1, -1.0;
  scenario.plant.initial.v_WQ << 0.1, 0.2, -0.1;
  scenario.plant.initial.rod = {0.3, 0.0, 0.5, 0.0};
  scenario.sensing = sensing;
  return scenario;
}

std::vector<PlantOfVehicles> make(const std::string& model, const config::Scenario& scenario) {
  return make_plants(find_plant_type({model, ""}), scenario, {0});
}

const config::Sensing kAwkward{{33'333'333, 20'000'000}, {20'000'000, 11'000'001}, 10'500'000};

TEST(SensedPlantTest, SeesAFreeFallAsOldAsItsSamplesAre) {
  // Without force the centre of mass falls on a parabola and the rod turns at a constant rate.
  const config::Scenario scenario = make_flight(kAwkward);
  const model::SlungLoadParameters& vehicle = scenario.vehicle;
  const double g = vehicle.gravity, length = vehicle.rod_length, rate = 0.5;
  const double arm = length * vehicle.load_mass / vehicle.total_mass();  // quadrotor to centre
  const auto calc_n = [&](double t) {
    const double alpha = 0.3 + rate * t;
    return Vector3d(0.0, -std::sin(alpha), std::cos(alpha));
  };
  const Vector3d n_dot_0 = rate * Vector3d(0.0, -std::cos(0.3), -std::sin(0.3));
  const Vector3d p_WQ_0 = scenario.plant.initial.position - length * calc_n(0.0);
  const auto calc_p_WQ = [&](double t) -> Vector3d {
    const Vector3d v_WC = scenario.plant.initial.v_WQ + arm * n_dot_0;
    return p_WQ_0 + arm * calc_n(0.0) + t * v_WC + 0.5 * g * t * t * Vector3d::UnitZ() -
           arm * calc_n(t);
  };
  for (const char* model : {"analytic", "slung_load"}) {
    auto plants = make(model, scenario);
    Plant& plant = *plants[0].plant;
    for (std::int64_t step = 0; step < 1000; step += kStepsPerPeriod) {
      const double body_time =
          1e-3 * static_cast<double>(find_seen_by_hand(kAwkward.body, kStepNs, step));
      const double rod_time =
          1e-3 * static_cast<double>(find_seen_by_hand(kAwkward.rod, kStepNs, step));
      const model::Measurement& seen = plant.seen(0);
      const double truncation = 1e-10;  // (ω h)⁴ and below, at numbers up to 10
      ASSERT_LE((seen.p_WQ - calc_p_WQ(body_time)).norm(), truncation) << model << ' ' << step;
      ASSERT_NEAR(seen.rod.alpha, 0.3 + rate * rod_time, truncation) << model << ' ' << step;
      ASSERT_LE((seen.p_WL - calc_p_WQ(body_time) - length * calc_n(rod_time)).norm(), truncation);
      ASSERT_LE((plant.measurement(0).p_WQ - calc_p_WQ(1e-3 * static_cast<double>(step))).norm(),
                truncation);
      plant.advance({Vector3d::Zero()}, kStepsPerPeriod);
    }
  }
}

TEST(SensedPlantTest, AForceThatSwitchesWithinAPeriodMovesADoubleIntegratorFromThere) {
  // The centre of mass obeys M r̈ = M g e₃ + F, exactly in each step of 1 ms.
  config::Sensing sensing;
  sensing.node_delay_ns = 2'500'000;  // acts 3 ms later: within the period of 4 ms
  const config::Scenario scenario = make_flight(sensing);
  auto plants = make("analytic", scenario);
  Plant& plant = *plants[0].plant;
  const model::SlungLoadParameters& vehicle = scenario.vehicle;
  const double mass = vehicle.total_mass(), h = 1e-3;
  const auto calc_centre = [&](const Vector3d& of_Q, const Vector3d& of_L) -> Vector3d {
    return (vehicle.quad_mass * of_Q + vehicle.load_mass * of_L) / mass;
  };
  const auto calc_force = [](std::int64_t k) {
    return Vector3d(3.0 * std::sin(0.9 * static_cast<double>(k)), k % 2 ? 5.0 : -5.0, -16.0);
  };
  const model::Measurement& now = plant.measurement(0);
  Vector3d p = calc_centre(now.p_WQ, now.p_WL), v = calc_centre(now.v_WQ, now.v_WL);
  for (std::int64_t k = 0; k < 500; ++k) {
    plant.advance({calc_force(k)}, kStepsPerPeriod);
    for (int i = 0; i < kStepsPerPeriod; ++i) {
      const Vector3d acting = calc_force(std::max<std::int64_t>(i < 3 ? k - 1 : k, 0));
      const Vector3d a = acting / mass + vehicle.gravity * Vector3d::UnitZ();
      p += h * v + 0.5 * h * h * a;
      v += h * a;
    }
    ASSERT_LE((calc_centre(now.p_WQ, now.p_WL) - p).norm(), 1e-11) << k;  // rounding of 2000 steps
    ASSERT_LE((calc_centre(now.v_WQ, now.v_WL) - v).norm(), 1e-11) << k;
  }
}

TEST(SensedPlantTest, AdvancesInAnyNumberOfCallsWithTheSameBits) {
  std::mt19937 random(7);
  config::Scenario scenario = make_flight(kAwkward);
  scenario.estimator.position << 0.1, 0.0, -0.1;
  for (const char* model : {"analytic", "slung_load"}) {
    auto at_once = make(model, scenario), in_parts = make(model, scenario);
    for (int period = 0; period < 300; ++period) {
      const std::vector<Vector3d> force = {Vector3d(std::sin(period), -0.3, -16.0)};
      at_once[0].plant->advance(force, kStepsPerPeriod);
      for (std::int64_t left = kStepsPerPeriod; left > 0;) {
        const std::int64_t steps = std::min<std::int64_t>(left, random() % 3);
        in_parts[0].plant->advance(force, steps);
        left -= steps;
      }
      expect_equal_bits(at_once[0].plant->measurement(0), in_parts[0].plant->measurement(0));
      expect_equal_bits(at_once[0].plant->seen(0), in_parts[0].plant->seen(0));
    }
  }
}

TEST(SensedPlantTest, AFailedStepLeavesStateAndMeasurementOfTheStepBefore) {
  for (const char* model : {"analytic", "slung_load"}) {
    auto plants = make(model, make_flight(kAwkward));
    Plant& plant = *plants[0].plant;
    plant.advance({Vector3d(0, 0, -16)}, 3);
    const model::Measurement before = plant.measurement(0), seen = plant.seen(0);
    EXPECT_EQ(test::find_error<std::runtime_error>(
                  [&] { plant.advance({Vector3d(0, std::nan(""), 0)}, 1); }),
              "force_y_n is not finite after step 3 of the plant")
        << model;
    expect_equal_bits(plant.measurement(0), before);
    expect_equal_bits(plant.seen(0), seen);
    plant.advance({Vector3d(1e308, 0, 0)}, 10);  // acts 11 steps later
    EXPECT_THROW(plant.advance({Vector3d(0, 0, -16)}, 20), std::runtime_error);
    EXPECT_TRUE(model::is_finite(plant.measurement(0)));
    EXPECT_TRUE(model::is_finite(plant.seen(0)));
    EXPECT_LE((plant.measurement(0).p_WL - before.p_WL).norm(), 0.1) << model;
  }
}

}  // namespace
}  // namespace sls::sim
