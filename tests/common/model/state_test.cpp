#include "common/model/state.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <limits>
#include <random>

#include "common/model/rotation.hpp"
#include "tests/support/random_vectors.hpp"

namespace sls::model {
namespace {

constexpr double kEps = std::numeric_limits<double>::epsilon();
constexpr double kHalfPi = 1.57079632679489661923;
constexpr int kStates = 20000;

/// An angle in (−π/2, π/2); every third one within 1e-9 … 1e-1 of an end.
double draw_angle(std::mt19937& generator) {
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  const double sign = unit(generator) < 0.5 ? -1.0 : 1.0;
  if (unit(generator) < 1.0 / 3.0) {
    return sign * (kHalfPi - std::pow(10.0, -9.0 + 8.0 * unit(generator)));
  }
  return sign * kHalfPi * unit(generator);
}

using test::draw_vector;

TEST(StateTest, AnglesSurviveTheWayOverDirectionsEvenNearTheLevelRod) {
  std::mt19937 generator(1);
  std::normal_distribution<double> rate(0.0, 3.0);
  for (int i = 0; i < kStates; ++i) {
    const RodAngles rod{draw_angle(generator), draw_angle(generator), rate(generator),
                        rate(generator)};
    const RodAngles back = to_angles(to_direction(rod));
    // A few roundings; near a level rod β̇ / cos β adds to the rounding of α̇.
    ASSERT_NEAR(back.alpha, rod.alpha, 8 * kEps);
    ASSERT_NEAR(back.beta, rod.beta, 8 * kEps);
    ASSERT_NEAR(back.beta_dot, rod.beta_dot,
                16 * kEps * (std::abs(rod.alpha_dot) + std::abs(rod.beta_dot)));
    ASSERT_NEAR(
        back.alpha_dot, rod.alpha_dot,
        16 * kEps * (std::abs(rod.alpha_dot) + std::abs(rod.beta_dot) / std::cos(rod.beta)));
  }
}

TEST(StateTest, DirectionsSurviveTheWayOverAnglesOnTheWholeSphere) {
  std::mt19937 generator(2);
  for (int i = 0; i < kStates; ++i) {
    const Eigen::Vector3d angular_velocity = draw_vector(generator, 3.0);
    RodDirection direction;
    direction.n_W = draw_vector(generator, 1.0).normalized();
    direction.n_dot_W = direction.n_W.cross(angular_velocity);
    const RodDirection back = to_direction(to_angles(direction));
    // A few roundings; near a level rod β is rounded near π/2, and cos β α̇ loses digits.
    const double cos_b = std::hypot(direction.n_W.y(), direction.n_W.z());
    ASSERT_LE((back.n_W - direction.n_W).norm(), 8 * kEps);
    ASSERT_LE((back.n_dot_W - direction.n_dot_W).norm(),
              8 * kEps * angular_velocity.norm() / cos_b);
  }
}

TEST(StateTest, DirectionIsAUnitVectorAndItsRateIsNormalToIt) {
  std::mt19937 generator(3);
  std::normal_distribution<double> rate(0.0, 3.0);
  for (int i = 0; i < kStates; ++i) {
    const RodAngles rod{2.0 * draw_angle(generator), draw_angle(generator), rate(generator),
                        rate(generator)};
    const RodDirection direction = to_direction(rod);
    ASSERT_NEAR(direction.n_W.norm(), 1.0, 4 * kEps);
    ASSERT_NEAR(direction.n_W.dot(direction.n_dot_W), 0.0,
                8 * kEps * (std::abs(rod.alpha_dot) + std::abs(rod.beta_dot)));
  }
}

TEST(StateTest, DirectionAgreesWithTheLiteralFormulaOfTheDesign) {
  std::mt19937 generator(4);
  std::uniform_real_distribution<double> angle(-1.5, 1.5);
  for (int i = 0; i < kStates; ++i) {
    const RodAngles rod{angle(generator), angle(generator), 0.0, 0.0};
    const Eigen::Vector3d expected(std::sin(rod.beta), -std::sin(rod.alpha) * std::cos(rod.beta),
                                   std::cos(rod.alpha) * std::cos(rod.beta));
    ASSERT_LE((to_direction(rod).n_W - expected).norm(), 2 * kEps);
  }
}

/// Fourth-order central difference.
template <typename Function>
auto differentiate(const Function& function, double h) {
  using Value = decltype(function(0.0));
  const Value value =
      (8.0 * (function(h) - function(-h)) - (function(2 * h) - function(-2 * h))) / (12.0 * h);
  return value;
}

TEST(StateTest, DirectionRateIsTheTimeDerivativeOfTheDirection) {
  std::mt19937 generator(6);
  std::normal_distribution<double> rate(0.0, 2.0);
  for (int i = 0; i < 1000; ++i) {
    const RodAngles rod{2.0 * draw_angle(generator), draw_angle(generator), rate(generator),
                        rate(generator)};
    const auto direction_at = [&](double t) -> Eigen::Vector3d {
      return to_direction({rod.alpha + rod.alpha_dot * t, rod.beta + rod.beta_dot * t, 0.0, 0.0})
          .n_W;
    };
    const double speed = 1.0 + std::abs(rod.alpha_dot) + std::abs(rod.beta_dot);
    // Truncation h⁴ speed⁵ / 30 with h = 1e-3, rounding eps / h.
    ASSERT_LE((differentiate(direction_at, 1e-3) - to_direction(rod).n_dot_W).norm(),
              1e-12 * std::pow(speed, 5));
  }
}

TEST(StateTest, HangingAtRestHasZeroAngles) {
  const SlungLoadState state = make_state(Eigen::Vector3d(1, 2, -3), Eigen::Vector3d::Zero(),
                                          Eigen::Vector3d(1, 2, -2), Eigen::Vector3d::Zero());
  EXPECT_EQ(state.rod.alpha, 0.0);
  EXPECT_EQ(state.rod.beta, 0.0);
  EXPECT_EQ(state.rod.alpha_dot, 0.0);
  EXPECT_EQ(state.rod.beta_dot, 0.0);
}

TEST(StateTest, PositiveBetaPutsTheLoadForwardAndPositiveAlphaPutsItLeft) {
  EXPECT_GT(to_direction({0.0, 0.1, 0.0, 0.0}).n_W.x(), 0.0);
  EXPECT_LT(to_direction({0.1, 0.0, 0.0, 0.0}).n_W.y(), 0.0);
}

TEST(StateTest, LoadAboveTheQuadrotorHasAlphaBeyondTheRightAngle) {
  const SlungLoadState up = make_state(Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero(),
                                       Eigen::Vector3d(0.0, -0.6, -0.8), Eigen::Vector3d::Zero());
  EXPECT_GT(up.rod.alpha, kHalfPi);
  EXPECT_NEAR(up.rod.alpha, 3.14159265358979323846 - std::asin(0.6), 4 * kEps);
  EXPECT_NEAR(up.rod.beta, 0.0, kEps);
}

TEST(StateTest, BothWaysToMakeAStateAgree) {
  std::mt19937 generator(7);
  std::normal_distribution<double> rate(0.0, 2.0);
  std::uniform_real_distribution<double> length(0.2, 3.0);
  for (int i = 0; i < 2000; ++i) {
    const RodAngles rod{1.9 * draw_angle(generator), 0.9 * draw_angle(generator), rate(generator),
                        rate(generator)};
    const double rod_length = length(generator);
    const SlungLoadState placed =
        make_state(draw_vector(generator, 3.0), draw_vector(generator, 2.0), rod, rod_length);
    ASSERT_NEAR((placed.p_WL - placed.p_WQ).norm(), rod_length, 1e-14);
    const SlungLoadState measured = make_state(placed.p_WQ, placed.v_WQ, placed.p_WL, placed.v_WL);
    // Differences of positions of some 10 m and rates of some 10 m/s, over L and cos β ≥ 0.03.
    const double tolerance = 1e-14 / rod_length / std::cos(rod.beta);
    ASSERT_NEAR(measured.rod.alpha, rod.alpha, tolerance);
    ASSERT_NEAR(measured.rod.beta, rod.beta, tolerance);
    ASSERT_NEAR(measured.rod.alpha_dot, rod.alpha_dot, 10 * tolerance / std::cos(rod.beta));
    ASSERT_NEAR(measured.rod.beta_dot, rod.beta_dot, 10 * tolerance / std::cos(rod.beta));
  }
}

TEST(StateTest, EveryNumberOfAStateIsLookedAtForBeingFinite) {
  const SlungLoadState good;
  EXPECT_TRUE(is_finite(good));
  for (const double bad :
       {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity(),
        -std::numeric_limits<double>::infinity()}) {
    for (Eigen::Vector3d SlungLoadState::*vector : {&SlungLoadState::p_WQ, &SlungLoadState::v_WQ,
                                                    &SlungLoadState::p_WL, &SlungLoadState::v_WL}) {
      for (int axis = 0; axis < 3; ++axis) {
        SlungLoadState state = good;
        (state.*vector)[axis] = bad;
        EXPECT_FALSE(is_finite(state));
      }
    }
    for (double RodAngles::*angle :
         {&RodAngles::alpha, &RodAngles::beta, &RodAngles::alpha_dot, &RodAngles::beta_dot}) {
      SlungLoadState state = good;
      state.rod.*angle = bad;
      EXPECT_FALSE(is_finite(state));
    }
  }
}

TEST(RotationTest, ATurnIsThatOfEigen) {
  for (double angle = -7.0; angle < 7.0; angle += 0.1)
    for (const Vector3d& axis :
         {Vector3d(Vector3d::UnitX()), Vector3d(Vector3d::UnitZ()), Vector3d(0.6, 0.0, -0.8)}) {
      const Eigen::Quaterniond expected(Eigen::AngleAxisd(angle, axis));
      // Both round a sine or cosine and a product.
      EXPECT_LT((make_turn(angle, axis).coeffs() - expected.coeffs()).norm(), 1e-15) << angle;
    }
}

}  // namespace
}  // namespace sls::model
