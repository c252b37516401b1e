// The filter of `px4` against the impulse response that follows from its poles.
#include "sim_server/autopilots/px4/low_pass_filter.hpp"

#include <gtest/gtest.h>

#include "tests/sim_server/autopilots/airframes.hpp"
#include "tests/sim_server/autopilots/px4_filter.hpp"

namespace sls::sim::px4 {
namespace {

using Eigen::Vector3d;
using sim::test::calc_impulse_response, sim::test::kPi;

struct Frequencies {
  double sample_rate, cut_off;
};

class LowPassFilterTest : public testing::TestWithParam<Frequencies> {};

TEST_P(LowPassFilterTest, ImpulseResponseIsThatOfTheTransformedPoles) {
  const auto [sample_rate, cut_off] = GetParam();
  const std::vector<double> expected = calc_impulse_response(sample_rate, cut_off, 500);
  LowPassFilter filter(sample_rate, cut_off);
  filter.step(Vector3d::Zero());  // initial value
  const Vector3d impulse(1.0, -2.0, 0.5);
  for (std::size_t n = 0; n < expected.size(); ++n) {
    const Vector3d filtered = filter.step(n == 0 ? impulse : Vector3d::Zero());
    for (int i = 0; i < 3; ++i) ASSERT_NEAR(filtered[i], impulse[i] * expected[n], 1e-12) << n;
  }
}

TEST_P(LowPassFilterTest, HalvesThePowerAtTheCutOff) {
  const auto [sample_rate, cut_off] = GetParam();
  LowPassFilter filter(sample_rate, cut_off);
  // Sine and cosine together: the amplitude then follows from one sample.
  Vector3d filtered;
  for (int n = 0; n < 20'000; ++n) {
    const double phase = 2.0 * kPi * cut_off / sample_rate * n;
    filtered = filter.step({std::sin(phase), std::cos(phase), 0.0});
  }
  EXPECT_NEAR(filtered.squaredNorm(), 0.5, 1e-9);  // 20,000 sines of large arguments
}

INSTANTIATE_TEST_SUITE_P(Frequencies, LowPassFilterTest,
                         testing::Values(Frequencies{250, 40}, Frequencies{250, 30},
                                         Frequencies{1000, 40}, Frequencies{250, 124},
                                         Frequencies{250, 1}));

TEST(LowPassFilterStartTest, AnswersAConstantWithItFromTheFirstSampleOn) {
  LowPassFilter filter(250, 40);
  const Vector3d constant(3.0, -1.0, 1e-3);
  for (int n = 0; n < 100; ++n) ASSERT_NEAR((filter.step(constant) - constant).norm(), 0.0, 1e-13);
}

TEST(LowPassFilterStartTest, LetsEverySampleThroughWhereItIsOff) {
  LowPassFilter filter(250, 0);
  std::mt19937_64 random(1);
  for (int n = 0; n < 10; ++n) {
    const Vector3d sample = sim::test::make_random_vector(random);
    EXPECT_EQ(filter.step(sample), sample);
  }
}

}  // namespace
}  // namespace sls::sim::px4
