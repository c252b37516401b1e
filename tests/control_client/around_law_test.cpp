#include "control_client/around_law.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <random>

#include "tests/support/random_vectors.hpp"

namespace sls::control {
namespace {

using test::draw_vector;

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

TEST(DragFeedForwardTest, ForceAndItsDragAddUpToTheLawsForce) {
  std::mt19937 generator(1);
  int judged = 0;
  while (judged < 2000) {
    Eigen::Vector3d wanted = draw_vector(generator, 4.0);
    wanted.z() -= 17.0;
    const Eigen::Vector3d v = draw_vector(generator, 2.0);
    const model::Aerodynamics air{0.3, draw_vector(generator, 2.0)};
    // Each iteration multiplies the error by about D |v − v_wind| / |F|: 20 need it below 1/5.
    if (air.rotor_drag * (v - air.v_wind_W).norm() > 0.15 * wanted.norm()) continue;
    ++judged;
    const Eigen::Vector3d force = calc_drag_feed_forward(wanted, v, air);
    // The iteration stops at a change of 1e-12; rounding adds a few 1e-16.
    ASSERT_LE((force + model::calc_rotor_drag(force, v, air) - wanted).norm(),
              1.01e-12 * wanted.norm());
  }
}

TEST(DragFeedForwardTest, WithoutDragNothingChanges) {
  const Eigen::Vector3d wanted(1.0, 2.0, -17.0);
  EXPECT_EQ(calc_drag_feed_forward(wanted, {3.0, 0.0, 1.0}, {}), wanted);
  EXPECT_EQ(calc_drag_feed_forward(wanted, {3.0, 0.0, 1.0}, {0.3, {3.0, 0.0, 1.0}}), wanted);
  EXPECT_EQ(calc_drag_feed_forward({0.0, 0.0, 0.0}, {3.0, 0.0, 1.0}, {0.3, {0.0, 0.0, 0.0}}),
            Eigen::Vector3d::Zero());
}

TEST(DragFeedForwardTest, StaysFiniteWhereNoForceCanOutweighTheDrag) {
  const Eigen::Vector3d force =
      calc_drag_feed_forward({0.0, 0.0, -0.1}, {30.0, 0.0, 5.0}, {0.5, {0.0, 0.0, 0.0}});
  EXPECT_TRUE(force.allFinite());
}

TEST(SaturationTest, KeepsTheDirectionAndNeverExceedsTheLimit) {
  std::mt19937 generator(1);
  std::normal_distribution<double> normal(0.0, 100.0);
  for (int i = 0; i < 20000; ++i) {
    const double x = normal(generator), y = normal(generator), z = normal(generator);
    const Eigen::Vector3d force(x, y, z);
    const Eigen::Vector3d limited = calc_saturated(force, 50.0);
    // The limit holds with both roundings of |F|: from squares and from hypot.
    ASSERT_LE(limited.norm(), 50.0);
    ASSERT_LE(std::hypot(limited.x(), limited.y(), limited.z()), 50.0);
    if (force.norm() > 50.0) {
      ASSERT_NEAR(limited.norm(), 50.0, 1e-10);
    }
    ASSERT_LE(limited.cross(force).norm(), 1e-13 * limited.norm() * force.norm());
    ASSERT_GT(limited.dot(force), 0.0);
  }
}

TEST(SaturationTest, LeavesAWeakForceAsItIs) {
  EXPECT_EQ(calc_saturated({0.0, 30.0, -40.0}, 50.0), Eigen::Vector3d(0.0, 30.0, -40.0));
  EXPECT_EQ(calc_saturated({0.0, 0.0, 0.0}, 50.0), Eigen::Vector3d::Zero());
}

TEST(SaturationTest, LimitsAForceWhoseSquareOverflows) {
  const Eigen::Vector3d limited = calc_saturated({3e200, 0.0, -4e200}, 50.0);
  EXPECT_LE((limited - Eigen::Vector3d(30.0, 0.0, -40.0)).norm(), 1e-10);
}

}  // namespace
}  // namespace sls::control
