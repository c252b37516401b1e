// Faults, judged by the samples that the receiver must hold (by hand or as a closed form) and by
// the statistics of independent draws: a count of N draws of probability p has the standard
// deviation √(N p (1 − p)). The bounds are five of these: a correct program misses them once in two
// million.
#include "sim_server/core/step/fault_line.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <random>
#include <string>

namespace sls::sim {
namespace {

using config::FaultChannel;
using Eigen::Vector3d;
using model::SlungLoadState;

constexpr std::int64_t kPeriod = 4'000'000;  // ns, the scenario's default
constexpr double kSigmas = 5.0;

config::Fault make_fault(const std::string& kind, FaultChannel on,
                         const config::FaultEffect& effect) {
  config::Fault fault;
  fault.kind = kind;
  fault.on = on;
  fault.effect = effect;
  return fault;
}
config::Fault make_command_fault(const config::FaultEffect& effect) {
  return make_fault("", FaultChannel::kCommand, effect);
}
config::Fault make_delay(std::int64_t periods) {
  return make_command_fault(config::DelayFault{periods * kPeriod});
}
/// `fault`, active during the steps [from, to).
config::Fault during(std::int64_t from, std::int64_t to, config::Fault fault) {
  fault.from_ns = from * kPeriod;
  fault.to_ns = to * kPeriod;
  return fault;
}
config::BiasFault make_force_bias(double f_x) {
  config::BiasFault bias;
  bias.offset.force.x() = f_x;
  return bias;
}

FaultLine make_line(const std::vector<config::Fault>& faults, std::uint32_t vehicle_id = 0) {
  config::Scenario scenario;
  scenario.faults = faults;
  return FaultLine(scenario, vehicle_id);
}

/// The acting force's x at the steps 0, 1, …, when the commanded force at step k is (k, 0, 0).
std::vector<double> actuate_steps(const std::vector<config::Fault>& faults, std::uint64_t steps) {
  FaultLine line = make_line(faults);
  std::vector<double> acting;
  for (std::uint64_t k = 0; k < steps; ++k)
    acting.push_back(line.actuate(k, {static_cast<double>(k), 0.0, 0.0}).x());
  return acting;
}

/// The force noise at the steps 0, 1, …: the acting force if the commanded force is zero.
std::vector<Vector3d> draw_forces(const std::vector<config::Fault>& faults, std::uint64_t steps) {
  FaultLine line = make_line(faults);
  std::vector<Vector3d> forces;
  for (std::uint64_t k = 0; k < steps; ++k) forces.push_back(line.actuate(k, Vector3d::Zero()));
  return forces;
}
config::Fault make_force_noise(const Vector3d& deviation, std::uint64_t seed) {
  config::NoiseFault noise;
  noise.deviation.force = deviation;
  noise.seed = seed;
  return make_command_fault(noise);
}

SlungLoadState make_tilted_state() {
  model::RodAngles rod;
  rod.alpha = 0.3;
  rod.beta = -0.4;
  rod.alpha_dot = 0.5;
  rod.beta_dot = 0.6;
  return model::make_state({1.0, 2.0, -3.0}, {0.1, 0.2, 0.3}, rod, 1.0);
}

bool have_equal_bits(const SlungLoadState& a, const SlungLoadState& b) {
  const auto bits = [](const SlungLoadState& s) {
    std::string bytes;
    for (const Vector3d& vector : {s.p_WQ, s.v_WQ, s.p_WL, s.v_WL})
      bytes.append(reinterpret_cast<const char*>(vector.data()), 3 * sizeof(double));
    for (const double number : {s.rod.alpha, s.rod.beta, s.rod.alpha_dot, s.rod.beta_dot})
      bytes.append(reinterpret_cast<const char*>(&number), sizeof number);
    return bytes;
  };
  return bits(a) == bits(b);
}

// --- no fault ------------------------------------------------------------------------------------

/// Feeds both channels of `line` with odd numbers and expects them back, bit for bit.
void expect_no_effect(FaultLine line) {
  std::mt19937_64 random(5);
  std::normal_distribution<double> normal;
  const auto vector = [&]() -> Vector3d { return {normal(random), -0.0, 5e-324 * random()}; };
  for (std::uint64_t k = 0; k < 100; ++k) {
    SlungLoadState state{vector(), vector(), vector(), vector(), {-0.0, normal(random), 0.0, 4.0}};
    EXPECT_TRUE(have_equal_bits(line.measure(k, state), state)) << k;
    const Vector3d force = vector(), acting = line.actuate(k, force);
    EXPECT_EQ(std::memcmp(acting.data(), force.data(), 3 * sizeof(double)), 0) << k;
  }
}

TEST(FaultLineTest, WithoutFaultsEverySamplePassesBitForBit) { expect_no_effect(make_line({})); }

TEST(FaultLineTest, BesidesTheirTimeFaultsChangeNoBit) {
  std::vector<config::Fault> faults;
  for (const FaultChannel on : {FaultChannel::kState, FaultChannel::kCommand}) {
    config::SampleOffset offset;
    offset.position.setOnes();
    offset.rod.alpha = 0.1;
    offset.force.setOnes();
    for (const config::FaultEffect& effect : std::initializer_list<config::FaultEffect>{
             config::DelayFault{5 * kPeriod}, config::DropFault{1.0, 1}, config::FreezeFault{},
             config::ReorderFault{1.0, 1}, config::BiasFault{offset},
             config::NoiseFault{offset, 1}})
      faults.push_back(during(100, 200, make_fault("", on, effect)));
  }
  expect_no_effect(make_line(faults));
}

TEST(FaultLineTest, FaultsOfAnotherVehicleChangeNoBit) {
  config::Fault fault = make_command_fault(config::FreezeFault{});
  fault.vehicle = 1;
  expect_no_effect(make_line({fault}));
  FaultLine other = make_line({fault}, 1);
  EXPECT_EQ(other.actuate(0, {1, 0, 0}).x(), 1.0);
  EXPECT_EQ(other.actuate(1, {2, 0, 0}).x(), 1.0);
}

TEST(FaultLineTest, AFaultLeavesTheOtherChannelAlone) {
  FaultLine line = make_line({make_fault("freeze", FaultChannel::kState, config::FreezeFault{})});
  SlungLoadState state;
  for (std::uint64_t k = 0; k < 5; ++k) {
    const double number = static_cast<double>(k);
    state.p_WQ.x() = number;
    EXPECT_EQ(line.measure(k, state).p_WQ.x(), 0.0);
    EXPECT_EQ(line.actuate(k, {number, 0, 0}).x(), number);
  }
}

// --- when ----------------------------------------------------------------------------------------

TEST(FaultLineTest, ActsOnStepsFromItsStartToBeforeItsEnd) {
  using Numbers = std::vector<double>;
  const config::Fault bias = make_command_fault(make_force_bias(100.0));
  EXPECT_EQ(actuate_steps({during(2, 4, bias)}, 6), (Numbers{0, 1, 102, 103, 4, 5}));
  EXPECT_EQ(actuate_steps({during(0, 1, bias)}, 3), (Numbers{100, 1, 2}));
  config::Fault between = bias;  // contains steps 2 and 3, at 8 and 12 ms
  between.from_ns = 4'000'001;
  between.to_ns = 12'000'001;
  EXPECT_EQ(actuate_steps({between}, 6), (Numbers{0, 1, 102, 103, 4, 5}));
  EXPECT_EQ(actuate_steps({bias}, 3), (Numbers{100, 101, 102}));  // default: always active
}

TEST(FaultLineTest, FaultsOfAChannelActInTheOrderOfTheFile) {
  const config::Fault freeze = during(2, 9, make_command_fault(config::FreezeFault{}));
  const config::Fault bias = during(3, 9, make_command_fault(make_force_bias(100.0)));
  // Freeze first: the force of step 1, biased from step 3 on. Bias first: at step 3 the freeze
  // already holds the force of step 1.
  EXPECT_EQ(actuate_steps({freeze, bias}, 5), (std::vector<double>{0, 1, 1, 101, 101}));
  EXPECT_EQ(actuate_steps({bias, freeze}, 5), (std::vector<double>{0, 1, 1, 1, 1}));
}

// --- delay ---------------------------------------------------------------------------------------

TEST(DelayTest, HoldsTheSampleOfThatManyPeriodsBeforeAndTheFirstUntilOneHasArrived) {
  for (const int periods : {0, 1, 2, 7, 50}) {
    const auto acting = actuate_steps({make_delay(periods)}, 200);
    for (int k = 0; k < 200; ++k)
      ASSERT_EQ(acting[static_cast<std::size_t>(k)], std::max(k - periods, 0)) << periods;
  }
}

TEST(DelayTest, StartsWithSamplesSentBeforeAndEndsAtOnce) {
  const auto acting = actuate_steps({during(5, 8, make_delay(3))}, 11);
  EXPECT_EQ(acting, (std::vector<double>{0, 1, 2, 3, 4, 2, 3, 4, 8, 9, 10}));
}

TEST(DelayTest, TwoDelaysAddUp) {
  EXPECT_EQ(actuate_steps({make_delay(3), make_delay(4)}, 100),
            actuate_steps({make_delay(7)}, 100));
}

TEST(DelayTest, DelaysWholeStates) {
  FaultLine line =
      make_line({make_fault("delay", FaultChannel::kState, config::DelayFault{2 * kPeriod})});
  std::vector<SlungLoadState> sent;
  for (std::uint64_t k = 0; k < 20; ++k) {
    SlungLoadState state = make_tilted_state();
    state.rod.beta_dot = state.v_WL.y() = 0.1 * static_cast<double>(k);
    sent.push_back(state);
    EXPECT_TRUE(have_equal_bits(line.measure(k, state), sent[k < 2 ? 0 : k - 2])) << k;
  }
}

// --- drop, freeze --------------------------------------------------------------------------------

TEST(DropTest, ReceiverKeepsTheLastThatArrived) {
  const config::Fault lost = make_command_fault(config::DropFault{1.0, 3});
  EXPECT_EQ(actuate_steps({during(2, 5, lost)}, 7), (std::vector<double>{0, 1, 1, 1, 1, 5, 6}));
  EXPECT_EQ(actuate_steps({lost}, 4), (std::vector<double>{0, 0, 0, 0}));
  const config::Fault none = make_command_fault(config::DropFault{0.0, 3});
  EXPECT_EQ(actuate_steps({none}, 4), (std::vector<double>{0, 1, 2, 3}));
}

TEST(DropTest, LosesTheShareOfItsProbabilityAndEachStepIndependently) {
  constexpr int kSteps = 200'000;
  for (const double p : {0.01, 0.2, 0.7}) {
    const auto acting = actuate_steps({make_command_fault(config::DropFault{p, 11})}, kSteps);
    // Not the first sample: it is held whether it is lost or not.
    std::vector<bool> lost;
    for (std::size_t k = 1; k < kSteps; ++k) lost.push_back(acting[k] != static_cast<double>(k));
    const double steps = static_cast<double>(lost.size());
    const auto expect_count = [&](double count, double probability) {
      EXPECT_NEAR(count, steps * probability,
                  kSigmas * std::sqrt(steps * probability * (1.0 - probability)))
          << p;
    };
    expect_count(static_cast<double>(std::count(lost.begin(), lost.end(), true)), p);
    for (const std::size_t distance : {1, 2, 3}) {
      int both = 0;
      for (std::size_t k = distance; k < lost.size(); ++k) both += lost[k] && lost[k - distance];
      // Neighbouring pairs share a draw, which increases the standard deviation by at most √3.
      EXPECT_NEAR(both, steps * p * p, kSigmas * std::sqrt(3.0 * steps * p * p)) << p;
    }
  }
}

TEST(FreezeTest, ReceiverKeepsWhatArrivedLastBefore) {
  const config::Fault frozen = make_command_fault(config::FreezeFault{});
  EXPECT_EQ(actuate_steps({during(3, 6, frozen)}, 8),
            (std::vector<double>{0, 1, 2, 2, 2, 2, 6, 7}));
  EXPECT_EQ(actuate_steps({during(0, 2, frozen)}, 4), (std::vector<double>{0, 0, 2, 3}));
}

// --- reorder -------------------------------------------------------------------------------------

TEST(ReorderTest, AnOvertakenSampleCountsOnePeriodLate) {
  const config::Fault late = make_command_fault(config::ReorderFault{1.0, 3});
  // Sample 3 arrives at step 4 and after sample 4.
  EXPECT_EQ(actuate_steps({during(3, 4, late)}, 7), (std::vector<double>{0, 1, 2, 2, 3, 5, 6}));
  // Two late samples: at step 4 only sample 3 arrives, at step 5 first sample 5, then sample 4.
  EXPECT_EQ(actuate_steps({during(3, 5, late)}, 7), (std::vector<double>{0, 1, 2, 2, 3, 4, 6}));
  EXPECT_EQ(actuate_steps({during(0, 1, late)}, 3), (std::vector<double>{0, 0, 2}));
  EXPECT_EQ(actuate_steps({late}, 50), actuate_steps({make_delay(1)}, 50));
  const config::Fault none = make_command_fault(config::ReorderFault{0.0, 3});
  EXPECT_EQ(actuate_steps({none}, 4), (std::vector<double>{0, 1, 2, 3}));
}

TEST(ReorderTest, AgesOfTheHeldSampleOccurAsOftenAsIndependentOvertakingMakesThem) {
  constexpr int kSteps = 200'000;
  for (const double p : {0.1, 0.5}) {
    const auto acting = actuate_steps({make_command_fault(config::ReorderFault{p, 4})}, kSteps);
    std::vector<double> counts(3);
    for (int k = 3; k < kSteps; ++k) {
      const double age = k - acting[static_cast<std::size_t>(k)];
      ASSERT_TRUE(age == 0.0 || age == 1.0 || age == 2.0) << k;
      ++counts[static_cast<std::size_t>(age)];
    }
    // Age 0: neither this sample k nor sample k − 1 is late. Age 2: sample k is late, and so was
    // sample k − 2, which arrived after sample k − 1.
    const double share[] = {(1 - p) * (1 - p), 1 - (1 - p) * (1 - p) - p * p * (1 - p),
                            p * p * (1 - p)};
    for (std::size_t age = 0; age < 3; ++age)
      // A step's age depends on three draws and correlates with at most two neighbours on either
      // side, which increases the standard deviation by at most √5.
      EXPECT_NEAR(counts[age], kSteps * share[age],
                  kSigmas * std::sqrt(5.0 * kSteps * share[age] * (1 - share[age])))
          << p << " age " << age;
  }
}

// --- bias ----------------------------------------------------------------------------------------

SlungLoadState measure_once(const config::FaultEffect& effect, const SlungLoadState& state) {
  return make_line({make_fault("", FaultChannel::kState, effect)}).measure(0, state);
}

TEST(BiasTest, PositionAndVelocityMoveQuadrotorAndLoadAlikeAndLeaveTheRod) {
  const SlungLoadState state = make_tilted_state();
  config::BiasFault bias;
  bias.offset.position << 0.1, -0.2, 0.3;
  bias.offset.velocity << 0.4, 0.5, -0.6;
  const SlungLoadState measured = measure_once(bias, state);
  EXPECT_EQ(measured.p_WQ, Vector3d(state.p_WQ + bias.offset.position));
  EXPECT_EQ(measured.p_WL, Vector3d(state.p_WL + bias.offset.position));
  EXPECT_EQ(measured.v_WQ, Vector3d(state.v_WQ + bias.offset.velocity));
  EXPECT_EQ(measured.v_WL, Vector3d(state.v_WL + bias.offset.velocity));
  EXPECT_EQ(measured.rod.alpha, state.rod.alpha);
  EXPECT_EQ(measured.rod.beta_dot, state.rod.beta_dot);
}

TEST(BiasTest, RodAnglesMoveTheLoadAboutTheQuadrotor) {
  const SlungLoadState state = make_tilted_state();
  config::BiasFault bias;
  bias.offset.rod.alpha = 0.02;
  bias.offset.rod.beta = -0.03;
  const SlungLoadState measured = measure_once(bias, state);
  EXPECT_EQ(measured.p_WQ, state.p_WQ);
  EXPECT_EQ(measured.v_WQ, state.v_WQ);
  // Eq. (1) of the model's README, written independently.
  const double alpha = 0.3 + 0.02, beta = -0.4 - 0.03;
  const Vector3d n_W(std::sin(beta), -std::sin(alpha) * std::cos(beta),
                     std::cos(alpha) * std::cos(beta));
  // Positions of a few metres have a rounding error of 1e-15 m.
  EXPECT_LT((measured.p_WL - measured.p_WQ - n_W).norm(), 1e-14);
}

TEST(BiasTest, RodRatesFollowFromTheLoadsVelocity) {
  config::BiasFault bias;
  bias.offset.rod.alpha_dot = 0.2;
  bias.offset.rod.beta_dot = -0.1;
  const SlungLoadState measured = measure_once(bias, make_tilted_state());
  const SlungLoadState inverse =
      model::make_state(measured.p_WQ, measured.v_WQ, measured.p_WL, measured.v_WL);
  EXPECT_NEAR(inverse.rod.alpha_dot, 0.5 + 0.2, 1e-14);  // rounding, as above
  EXPECT_NEAR(inverse.rod.beta_dot, 0.6 - 0.1, 1e-14);
  EXPECT_NEAR(inverse.rod.alpha, 0.3, 1e-14);
}

TEST(BiasTest, KeepsTheRodsLengthOfTheScenario) {
  config::Scenario scenario;
  scenario.vehicle.rod_length = 0.7;
  config::BiasFault bias;
  bias.offset.rod.beta = 0.1;
  bias.offset.position << 1.0, 1.0, 1.0;
  scenario.faults = {make_fault("bias", FaultChannel::kState, bias)};
  const SlungLoadState state = model::make_state(Vector3d(0, 0, -1), Vector3d(0, 0, 0), {}, 0.7);
  const SlungLoadState measured = FaultLine(scenario, 0).measure(0, state);
  EXPECT_EQ(measured.p_WQ, Vector3d(1, 1, 0));
  EXPECT_NEAR((measured.p_WL - measured.p_WQ).norm(), 0.7, 1e-15);
}

TEST(BiasTest, ARodWhoseJointIsNotAtTheOriginTurnsAboutItsJoint) {
  const Vector3d p_QJ_W(0.1, -0.02, 0.05), v_QJ_W(0.3, 0.1, -0.2);
  SlungLoadState state = make_tilted_state();
  state.p_WL += p_QJ_W;
  state.v_WL += v_QJ_W;
  config::BiasFault bias;
  bias.offset.rod.alpha = 1e-9;
  SlungLoadState measured = measure_once(bias, state);
  EXPECT_LT((measured.p_WL - state.p_WL).norm(), 2e-9);  // 1e-9 rad of a rod of 1 m
  EXPECT_LT((measured.v_WL - state.v_WL).norm(), 2e-9);

  bias.offset.rod.alpha = 0.3;
  bias.offset.position << 1.0, 2.0, 3.0;
  measured = measure_once(bias, state);
  const SlungLoadState rod =
      model::make_state(measured.p_WQ + p_QJ_W, measured.v_WQ + v_QJ_W, measured.rod, 1.0);
  EXPECT_LT((measured.p_WL - rod.p_WL).norm(), 1e-14);  // rounding of positions of a few metres
  EXPECT_LT((measured.v_WL - rod.v_WL).norm(), 1e-14);
}

TEST(BiasTest, AddsToTheForce) {
  EXPECT_EQ(actuate_steps({make_command_fault(make_force_bias(0.5))}, 3),
            (std::vector<double>{0.5, 1.5, 2.5}));
}

// --- noise ---------------------------------------------------------------------------------------

TEST(NoiseTest, IsNormalWithTheGivenDeviationsAndIndependentInTimeAndComponent) {
  constexpr int kSteps = 100'000;
  const Vector3d deviation(0.5, 2.0, 0.0);
  const auto forces = draw_forces({make_force_noise(deviation, 3)}, kSteps);
  Eigen::MatrixXd z(3, kSteps);
  for (int k = 0; k < kSteps; ++k) z.col(k) = forces[static_cast<std::size_t>(k)];
  EXPECT_TRUE(z.row(2).isZero(0.0));
  z.row(0) /= deviation.x();
  z.row(1) /= deviation.y();
  // The mean of zⁿ over N standard normal numbers has the variance (E z²ⁿ − (E zⁿ)²) / N: 1, 2, 15,
  // 96 over N for n = 1 to 4. The mean product of independent numbers has the variance 1 / N.
  const double root = std::sqrt(static_cast<double>(kSteps));
  for (int i = 0; i < 2; ++i) {
    const Eigen::ArrayXd x = z.row(i).transpose().array();
    EXPECT_NEAR(x.mean(), 0.0, kSigmas / root);
    EXPECT_NEAR(x.square().mean(), 1.0, kSigmas * std::sqrt(2.0) / root);
    EXPECT_NEAR(x.cube().mean(), 0.0, kSigmas * std::sqrt(15.0) / root);
    EXPECT_NEAR(x.square().square().mean(), 3.0, kSigmas * std::sqrt(96.0) / root);
    for (const int lag : {1, 2, 10})
      EXPECT_NEAR((x.tail(kSteps - lag) * x.head(kSteps - lag)).mean(), 0.0,
                  kSigmas / std::sqrt(static_cast<double>(kSteps - lag)));
    // 4.55 % exceed two standard deviations.
    const double beyond = static_cast<double>((x.abs() > 2.0).count()) / kSteps;
    const double share = std::erfc(std::sqrt(2.0));
    EXPECT_NEAR(beyond, share, kSigmas * std::sqrt(share * (1 - share)) / root);
  }
  EXPECT_NEAR(z.row(0).dot(z.row(1)) / kSteps, 0.0, kSigmas / root);
}

TEST(NoiseTest, EveryNumberOfAStateHasItsOwnDeviation) {
  constexpr int kSteps = 20'000;
  config::NoiseFault noise;
  noise.deviation.position << 0.01, 0.02, 0.03;
  noise.deviation.velocity << 0.04, 0.05, 0.06;
  noise.deviation.rod.alpha = 0.07;
  noise.deviation.rod.beta = 0.08;
  noise.deviation.rod.alpha_dot = 0.09;
  noise.deviation.rod.beta_dot = 0.1;
  FaultLine line = make_line({make_fault("noise", FaultChannel::kState, noise)});
  const SlungLoadState truth = make_tilted_state();
  Eigen::Matrix<double, 10, 10> covariance = Eigen::Matrix<double, 10, 10>::Zero();
  for (std::uint64_t k = 0; k < kSteps; ++k) {
    const SlungLoadState measured = line.measure(k, truth);
    Eigen::Matrix<double, 10, 1> z;
    z << measured.p_WQ - truth.p_WQ, measured.v_WQ - truth.v_WQ,
        measured.rod.alpha - truth.rod.alpha, measured.rod.beta - truth.rod.beta,
        measured.rod.alpha_dot - truth.rod.alpha_dot, measured.rod.beta_dot - truth.rod.beta_dot;
    for (int i = 0; i < 10; ++i) z[i] /= 0.01 * (i + 1);
    covariance += z * z.transpose() / kSteps;
    // The load's position fits the measured angles: the sample is consistent.
    EXPECT_NEAR((measured.p_WL - measured.p_WQ).norm(), 1.0, 1e-14);
  }
  // Variances of the mean: 2 / N on the diagonal, 1 / N elsewhere.
  const auto error = covariance - Eigen::Matrix<double, 10, 10>::Identity();
  EXPECT_LT(error.cwiseAbs().maxCoeff(), kSigmas * std::sqrt(2.0 / kSteps));
}

// --- reproducibility -----------------------------------------------------------------------------

// Computed with Python from the definition in README.md. The test finds every change of the
// generator, because recordings of old versions must stay reproducible.
TEST(RandomTest, NumbersAreTheDocumentedFunctionOfSeedPlaceStepAndComponent) {
  const auto acting = actuate_steps({make_command_fault(config::DropFault{0.5, 7})}, 64);
  std::string pattern;
  for (std::size_t k = 1; k < 64; ++k) pattern += acting[k] == static_cast<double>(k) ? '.' : 'x';
  EXPECT_EQ(pattern, "x.xxx..xxx.x..x..xx..x.xxx....x.xx..x...xxx....x...xx...x....xx");

  // The noise is the second fault of the file. The first has no effect.
  const auto forces = draw_forces({make_delay(0), make_force_noise({1, 1, 1}, 3)}, 1001);
  // A number needs a few operations and two functions of libm: a rounding error near 1e-16.
  EXPECT_LT((forces[0] - Vector3d(-0.08203744824885163, -0.055434045018384656, -0.3723660178681789))
                .norm(),
            1e-14);
  EXPECT_LT((forces[1000] - Vector3d(0.07744148157345898, 0.5089526194247852, -0.30970387529270155))
                .norm(),
            1e-14);
}

std::vector<config::Fault> make_random_faults() {
  return {make_command_fault(config::DropFault{0.3, 1}),
          make_command_fault(config::ReorderFault{0.3, 1}), make_force_noise({1, 1, 1}, 1)};
}

TEST(RandomTest, TheSameScenarioGivesTheSameBits) {
  EXPECT_EQ(draw_forces(make_random_faults(), 1000), draw_forces(make_random_faults(), 1000));
}

TEST(RandomTest, LinesAndChannelsDoNotDisturbEachOther) {
  const auto alone = draw_forces(make_random_faults(), 1000);
  auto faults = make_random_faults();
  faults.push_back(make_fault("drop", FaultChannel::kState, config::DropFault{0.5, 1}));
  FaultLine one = make_line(faults), two = make_line(make_random_faults());
  for (std::uint64_t k = 0; k < 1000; ++k) {
    one.measure(k, {});
    EXPECT_EQ(one.actuate(k, Vector3d::Zero()), alone[k]);
    EXPECT_EQ(two.actuate(k, Vector3d::Zero()), alone[k]);
  }
}

TEST(RandomTest, AFaultDrawsTheSameNumbersBesideAnyOtherFaults) {
  const config::Fault noise = make_force_noise({1, 1, 1}, 9);
  const auto among = [&](const config::Fault& first, const config::Fault& last) {
    return draw_forces({first, noise, last}, 500);
  };
  const auto idle = during(9000, 9001, make_command_fault(config::DropFault{1.0, 9}));
  const auto alone = among(idle, idle);
  // If the commanded force is zero, a drop before the noise changes nothing.
  EXPECT_EQ(among(make_command_fault(config::DropFault{0.5, 9}), idle), alone);
  EXPECT_EQ(among(idle, make_fault("freeze", FaultChannel::kState, config::FreezeFault{})), alone);
  // The numbers of a step do not depend on whether earlier steps drew any.
  const auto later = draw_forces({idle, during(400, 500, noise), idle}, 500);
  EXPECT_EQ(later[399], Vector3d(0, 0, 0));
  EXPECT_EQ(later[400], alone[400]);
}

TEST(RandomTest, SeedsAndPlacesInTheFileGiveUnrelatedNumbers) {
  constexpr int kSteps = 50'000;
  const auto idle = during(90'000'000, 90'000'001, make_delay(0));
  const auto base = draw_forces({make_force_noise({1, 1, 1}, 1)}, kSteps);
  const auto other_seed = draw_forces({make_force_noise({1, 1, 1}, 2)}, kSteps);
  const auto other_place = draw_forces({idle, make_force_noise({1, 1, 1}, 1)}, kSteps);
  for (const auto& other : {other_seed, other_place}) {
    for (std::size_t shift = 0; shift < 3; ++shift) {
      double product = 0.0;
      for (std::size_t k = shift; k < kSteps; ++k) product += base[k].dot(other[k - shift]);
      // Three products of independent standard normal numbers a step, variance 1 each.
      EXPECT_NEAR(product, 0.0, kSigmas * std::sqrt(3.0 * kSteps));
    }
  }
}

}  // namespace
}  // namespace sls::sim
