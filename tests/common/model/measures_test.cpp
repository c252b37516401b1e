// Measures against closed forms: sines, step responses of linear systems, circles.
#include "common/model/measures.hpp"

#include <gtest/gtest.h>

#include "common/model/state.hpp"

namespace sls::model {
namespace {

using Eigen::Vector3d;

constexpr double kPi = 3.14159265358979323846;
constexpr double kPeriod = 1e-3;  // s

/// Responses to `respond(time)`, which begins at 0 and has the target 1, on the axis x; over 20 s.
template <class Respond>
StepResponses respond_along_x(Respond respond, double start_s = 0.0) {
  StepResponses responses;
  for (int k = 0; k < 20'000; ++k)
    responses.add(start_s + k * kPeriod, {respond(k * kPeriod) - 1.0, 0.0, 0.0});
  return responses;
}

TEST(ErrorStatisticsTest, ASineHasItsAmplitudeOverTheRootOfTwo) {
  ErrorStatistics statistics;
  for (int k = 0; k < 1000; ++k) {  // whole periods: x and y turn, z rests
    const double angle = 2.0 * kPi * k / 1000.0;
    statistics.add({3.0 * std::sin(angle), 3.0 * std::cos(angle), -4.0});
  }
  EXPECT_EQ(statistics.samples(), 1000u);
  EXPECT_NEAR(statistics.calc_rms(0), 3.0 / std::sqrt(2.0), 1e-12);
  EXPECT_NEAR(statistics.calc_rms(1), 3.0 / std::sqrt(2.0), 1e-12);
  EXPECT_NEAR(statistics.calc_rms(2), 4.0, 1e-12);
  EXPECT_NEAR(statistics.calc_rms(kNorm), 5.0, 1e-12);
  EXPECT_NEAR(statistics.calc_max(0), 3.0, 1e-12);
  EXPECT_EQ(statistics.find_worst(0), 250u);
  EXPECT_EQ(statistics.find_worst(1), 0u);
  EXPECT_NEAR(statistics.calc_max(kNorm), 5.0, 1e-12);
  EXPECT_EQ(statistics.calc_end(2), 4.0);
  EXPECT_NEAR(statistics.calc_end(kNorm), 5.0, 1e-12);
}

TEST(ErrorStatisticsTest, WithoutSamplesNothingIsDefined) {
  const ErrorStatistics statistics;
  for (int i = 0; i < kComponents; ++i)
    EXPECT_TRUE(std::isnan(statistics.calc_rms(i)) && std::isnan(statistics.calc_max(i)) &&
                std::isnan(statistics.calc_end(i)));
}

TEST(LargestTest, IsTheFirstOfEqualOnesAndIgnoresNaN) {
  Largest largest;
  EXPECT_TRUE(std::isnan(largest.value()));
  std::uint64_t sample = 0;
  for (const double number : {std::nan(""), -2.0, -1.0, std::nan(""), -1.0, -3.0})
    largest.add(number, sample++);
  EXPECT_EQ(largest.value(), -1.0);
  EXPECT_EQ(largest.sample(), 2u);
}

TEST(StepResponsesTest, TheOvershootOfASecondOrderSystemIsKnown) {
  for (const double damping : {0.1, 0.3, 0.5, 0.7, 0.9}) {
    const double frequency = 2.0, damped = frequency * std::sqrt(1.0 - damping * damping);
    const StepResponses responses = respond_along_x([&](double t) {
      return 1.0 - std::exp(-damping * frequency * t) *
                       (std::cos(damped * t) + damping * frequency / damped * std::sin(damped * t));
    });
    // The response is flat around its peak: the nearest sample is at most (ω T)² / 8 below it.
    const double expected = std::exp(-kPi * damping / std::sqrt(1.0 - damping * damping));
    for (const int component : {0, kNorm})
      EXPECT_NEAR(responses[component].calc_overshoot(), expected, 1e-6);
    EXPECT_NEAR(static_cast<double>(responses[0].beyond().sample()) * kPeriod, kPi / damped,
                kPeriod);
    EXPECT_TRUE(std::isnan(responses[1].calc_overshoot())) << "y has no step";
  }
}

TEST(StepResponsesTest, TheSettlingTimeOfAFirstOrderSystemIsKnownAndHasNoOvershoot) {
  for (const double constant : {0.2, 1.0, 3.0})
    for (const double start_s : {0.0, 128.0}) {
      const StepResponses responses =
          respond_along_x([&](double t) { return 1.0 - std::exp(-t / constant); }, start_s);
      // The error is 2 % after ln 50 time constants; the next sample is at most a period later.
      for (const int component : {0, kNorm}) {
        const double settled = responses[component].calc_settling_time();
        EXPECT_GE(settled, constant * std::log(50.0) - 1e-9);
        EXPECT_LE(settled, constant * std::log(50.0) + kPeriod + 1e-9);
        EXPECT_EQ(responses[component].calc_overshoot(), 0.0);
      }
      EXPECT_TRUE(std::isnan(responses[2].calc_settling_time())) << "z has no step";
    }
}

TEST(StepResponsesTest, TheSettlingTimeWaitsForTheLastSwingOutOfTheBand) {
  // An undamped swing of 3 % for 10 s, then rest: it leaves the band of 2 % at each peak.
  const StepResponses responses = respond_along_x([](double t) {
    return t == 0.0 ? 0.0 : t < 10.0 ? 1.0 + 0.03 * std::sin(2.0 * kPi * t) : 1.0;
  });
  const double last_crossing = 10.0 - std::asin(2.0 / 3.0) / (2.0 * kPi);
  EXPECT_NEAR(responses[0].calc_settling_time(), last_crossing, kPeriod);
}

TEST(StepResponsesTest, AStepThatNeverSettlesIsInfiniteAndASmallOneUndefined) {
  EXPECT_TRUE(
      std::isinf(respond_along_x([](double t) { return t / 40.0; })[0].calc_settling_time()));
  const StepResponses small = respond_along_x([](double) { return 0.9901; });
  EXPECT_TRUE(std::isnan(small[0].calc_settling_time()));
  EXPECT_TRUE(std::isnan(small[kNorm].calc_overshoot()));
}

TEST(SettlingTest, AnAbsoluteBandNeedsToHoldOnlyAsLongAsRequested) {
  // 0.3 exp(−t) is 0.05 after ln 6 = 1.79 s. From 3.5 s on the distance is large again.
  for (const auto& [hold_s, expected] : {std::pair(1.0, std::log(6.0)), std::pair(5.0, 6.0),
                                         std::pair(100.0, HUGE_VAL), std::pair(HUGE_VAL, 6.0)}) {
    Settling settling(0.05, hold_s);
    for (int k = 0; k < 20'000; ++k) {
      const double t = k * kPeriod;
      settling.add(t, t < 3.5 || t >= 6.0 ? 0.3 * std::exp(-t) : 0.06);
    }
    if (std::isinf(expected)) {
      EXPECT_EQ(settling.calc_time(), expected);
    } else {
      EXPECT_NEAR(settling.calc_time(), expected, kPeriod);
      EXPECT_NEAR(static_cast<double>(settling.sample()) * kPeriod, expected, kPeriod);
    }
  }
  EXPECT_TRUE(std::isnan(Settling(0.05).calc_time()));
}

TEST(SteadyStateErrorTest, IsTheMeanOfTheLastTenth) {
  // The last 2 of 20 s hold 0.25 and a whole period of a sine. Earlier values do not count.
  const Eigen::VectorXd time_s = Eigen::VectorXd::LinSpaced(20'000, 0.0, 19.999);
  Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor> errors(20'000, 3);
  for (Eigen::Index k = 0; k < errors.rows(); ++k) {
    const double x = time_s[k] < 17.9 ? 9.0 : 0.25 + std::sin(kPi * time_s[k]);
    errors.row(k) << x, -x, 1.0;
  }
  EXPECT_NEAR((calc_steady_state_error(time_s, errors) - Vector3d(0.25, -0.25, 1.0)).norm(), 0.0,
              1e-3);
}

TEST(QuadReferenceTest, OnAConicalOrbitTheRodHasTheAngleOfTheOrbit) {
  // The load on a circle of radius L sin θ inside the one of a quadrotor that rests on the axis:
  // Ω² = g / (L cos θ) for a suspension that does not move.
  SlungLoadParameters vehicle;
  vehicle.rod_length = 0.7;
  const double theta = 0.4, radius = vehicle.rod_length * std::sin(theta);
  const double squared_rate = vehicle.gravity / (vehicle.rod_length * std::cos(theta));
  for (const double angle : {0.0, 1.0, 4.0}) {
    Reference reference;
    const Vector3d outward(std::cos(angle), std::sin(angle), 0.0);
    reference.position = radius * outward + Vector3d(5.0, -3.0, -2.0);
    reference.acceleration = -squared_rate * radius * outward;
    const Vector3d expected(5.0, -3.0, -2.0 - vehicle.rod_length * std::cos(theta));
    EXPECT_NEAR((calc_quad_reference(reference, vehicle) - expected).norm(), 0.0, 1e-14);
  }
}

TEST(TiltTest, IsTheAngleBetweenTwoDirections) {
  for (const double angle : {0.0, 1e-9, 0.3, 1.5, 3.0, kPi})
    for (const double heading : {0.0, 2.0}) {
      const Vector3d axis(std::cos(heading), std::sin(heading), 0.0);
      const Eigen::Quaterniond turned(Eigen::AngleAxisd(angle, axis));
      EXPECT_NEAR(calc_rod_tilt(0.7 * (turned * Vector3d::UnitZ())), angle, 1e-15 + 1e-15 * angle);
      // A turn about the body's own z axis does not tilt it.
      const Eigen::Quaterniond q_WB = turned * Eigen::AngleAxisd(1.1, Vector3d::UnitZ());
      EXPECT_NEAR(calc_body_tilt(q_WB), angle, 1e-15);
    }
}

}  // namespace
}  // namespace sls::model
