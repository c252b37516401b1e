#include "control_client/state_wiring.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace sls::control {
namespace {

TEST(StateWiringTest, CorrectWiringChangesNothing) {
  const model::RodAngles slots =
      calc_wired_angles({0.1, -0.2, 0.3, -0.4}, config::StateWiring::kCorrect, 1.1);
  EXPECT_EQ(slots.alpha, 0.1);
  EXPECT_EQ(slots.beta, -0.2);
  EXPECT_EQ(slots.alpha_dot, 0.3);
  EXPECT_EQ(slots.beta_dot, -0.4);
}

TEST(StateWiringTest, GazeboWiringFollowsTheLiteralFormula) {
  std::mt19937 generator(1);
  std::uniform_real_distribution<double> angle(-1.3, 1.3), rate(-5.0, 5.0);
  for (int i = 0; i < 1000; ++i) {
    const double a = angle(generator), b = angle(generator);
    const double a_dot = rate(generator), b_dot = rate(generator), L = 1.1;
    const model::RodAngles slots =
        calc_wired_angles({a, b, a_dot, b_dot}, config::StateWiring::kGazeboPlugin, L);
    EXPECT_EQ(slots.alpha, b);
    EXPECT_EQ(slots.beta, -a);
    const double swirl = 2 * L * (std::sin(a) / std::cos(a)) * (std::sin(b) / std::cos(b)) * b_dot;
    EXPECT_NEAR(slots.alpha_dot, L * a_dot - swirl, 1e-13 * (10 + std::abs(swirl)));
    EXPECT_EQ(slots.beta_dot, L * b_dot);
  }
}

TEST(StateWiringTest, GazeboWiringIsHarmlessOnlyWhileTheRodHangsStill) {
  const model::RodAngles slots =
      calc_wired_angles({0.0, 0.0, 0.0, 0.0}, config::StateWiring::kGazeboPlugin, 1.1);
  EXPECT_EQ(slots.alpha, 0.0);
  EXPECT_EQ(slots.beta, 0.0);
  EXPECT_EQ(slots.alpha_dot, 0.0);
  EXPECT_EQ(slots.beta_dot, 0.0);
}

}  // namespace
}  // namespace sls::control
