// The sampled PID of `px4` against sums and convolutions.
#include "sim_server/autopilots/px4/rate_control.hpp"

#include <gtest/gtest.h>

#include "tests/sim_server/autopilots/airframes.hpp"
#include "tests/sim_server/autopilots/px4_filter.hpp"

namespace sls::sim::px4 {
namespace {

using Eigen::Vector3d;
using sim::test::calc_impulse_response, sim::test::make_random_vector;

constexpr double kPeriod = 0.004;

RateGains make_unfiltered() {
  RateGains gains;
  gains.rate_cut_off = gains.derivative_cut_off = 0.0;
  return gains;
}

/// Rates that begin at rest.
std::vector<Vector3d> make_rates(std::size_t count) {
  std::mt19937_64 random(11);
  std::vector<Vector3d> rates{Vector3d::Zero()};
  while (rates.size() < count) rates.push_back(2.0 * make_random_vector(random));
  return rates;
}

/// Output of a filter with this impulse response for `inputs`. The first input is 0.
std::vector<Vector3d> convolve(const std::vector<double>& response,
                               const std::vector<Vector3d>& inputs) {
  std::vector<Vector3d> outputs(inputs.size(), Vector3d::Zero());
  for (std::size_t n = 0; n < inputs.size(); ++n)
    for (std::size_t k = 0; k <= n; ++k) outputs[n] += response[k] * inputs[n - k];
  return outputs;
}

TEST(RateControlTest, IsTheSumsOfASampledPidWithoutFilters) {
  const RateGains gains = make_unfiltered();
  RateControl control(gains, kPeriod);
  const std::vector<Vector3d> rates = make_rates(300);
  const Vector3d wanted(0.5, -1.0, 0.2);
  Vector3d sum = Vector3d::Zero();
  for (std::size_t n = 0; n < rates.size(); ++n) {
    const Vector3d torque = control.step(rates[n], wanted, {});
    const Vector3d last = n > 0 ? rates[n - 1] : rates[0];
    const double off = 400.0 * std::acos(-1.0) / 180.0;
    for (int i = 0; i < 3; ++i) {
      const double e = wanted[i] - rates[n][i];
      const double expected = gains.proportional[i] * e + gains.integral[i] * kPeriod * sum[i] -
                              gains.derivative[i] * (rates[n][i] - last[i]) / kPeriod;
      ASSERT_NEAR(torque[i], expected, 1e-12) << n;
      sum[i] += e - e * e * e / (off * off);
    }
  }
}

TEST(RateControlTest, FiltersRatesAndTheirDerivativeOnTop) {
  RateGains gains;
  gains.integral.setZero();
  RateControl control(gains, kPeriod);
  const std::vector<Vector3d> rates = make_rates(300);
  const auto filtered = convolve(calc_impulse_response(250, 40, rates.size()), rates);
  std::vector<Vector3d> differences{Vector3d::Zero()};
  for (std::size_t n = 1; n < rates.size(); ++n)
    differences.push_back((filtered[n] - filtered[n - 1]) / kPeriod);
  const auto accelerations = convolve(calc_impulse_response(250, 30, rates.size()), differences);
  for (std::size_t n = 0; n < rates.size(); ++n) {
    const Vector3d torque = control.step(rates[n], Vector3d::Zero(), {});
    const Vector3d expected = -gains.proportional.cwiseProduct(filtered[n]) -
                              gains.derivative.cwiseProduct(accelerations[n]);
    ASSERT_NEAR((torque - expected).norm(), 0.0, 1e-12) << n;
  }
}

TEST(RateControlTest, FilteredPidStartsWithoutAJerkWhereTheBodyTurnsAlready) {
  RateControl control(RateGains{}, kPeriod);
  const Vector3d rates(1.0, -2.0, 0.5);
  EXPECT_NEAR(control.step(rates, rates, {}).norm(), 0.0, 1e-14);
}

TEST(RateControlTest, IntegratorKeepsToItsLimit) {
  RateGains gains = make_unfiltered();
  gains.proportional.setZero();
  gains.integral_limits = {0.3, 0.1, 0.0};
  RateControl control(gains, kPeriod);
  Vector3d torque;
  for (int n = 0; n < 5000; ++n) torque = control.step(Vector3d::Zero(), Vector3d::Ones(), {});
  EXPECT_EQ(torque, Vector3d(0.3, 0.1, 0.0));
  for (int n = 0; n < 5000; ++n) torque = control.step(Vector3d::Ones(), Vector3d::Zero(), {});
  EXPECT_EQ(torque, Vector3d(-0.3, -0.1, 0.0));
}

TEST(RateControlTest, IntegratorStandsStillInTheDirectionThatSaturates) {
  RateGains gains = make_unfiltered();
  gains.proportional.setZero();
  Saturation saturation;
  saturation.positive = {true, false, false};
  saturation.negative = {false, true, false};
  RateControl control(gains, kPeriod);
  const Vector3d up(1.0, 1.0, 1.0);
  control.step(Vector3d::Zero(), up, saturation);
  Vector3d torque = control.step(Vector3d::Zero(), -up, saturation);
  EXPECT_EQ(torque.x(), 0.0);
  EXPECT_GT(torque.y(), 0.0);
  EXPECT_GT(torque.z(), 0.0);
  torque = control.step(Vector3d::Zero(), up, {});
  EXPECT_LT(torque.x(), 0.0);
  EXPECT_GT(torque.y(), 0.0);
  EXPECT_EQ(torque.z(), 0.0);
}

TEST(RateControlTest, DoesNotIntegrateLargeErrors) {
  RateGains gains = make_unfiltered();
  gains.proportional.setZero();
  RateControl control(gains, kPeriod);
  Vector3d torque;
  for (int n = 0; n < 100; ++n)
    torque = control.step(Vector3d::Zero(), Vector3d::Constant(7.0), {});
  EXPECT_EQ(torque, Vector3d::Zero());
}

}  // namespace
}  // namespace sls::sim::px4
