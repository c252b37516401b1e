// Rate set-points of `px4`: limits for small angles, closed forms for one axis, half a turn.
#include "sim_server/autopilots/px4/attitude_control.hpp"

#include <gtest/gtest.h>

#include "tests/sim_server/autopilots/airframes.hpp"

namespace sls::sim::px4 {
namespace {

using Eigen::AngleAxisd, Eigen::Quaterniond, Eigen::Vector3d;
using sim::test::kPi, sim::test::make_random_attitude, sim::test::make_random_vector;

AttitudeGains make_unlimited() {
  AttitudeGains gains;
  gains.rate_limits.setConstant(1e3);
  return gains;
}

TEST(AttitudeControlTest, IsTheGainTimesTheErrorForSmallAngles) {
  std::mt19937_64 random(2);
  const AttitudeGains gains = make_unlimited();
  for (int i = 0; i < 100; ++i) {
    const Quaterniond q = make_random_attitude(random);
    const Vector3d error = 1e-5 * make_random_vector(random);
    const Quaterniond wanted = q * Quaterniond(AngleAxisd(error.norm(), error.normalized()));
    // Tolerance: terms of second order in the angle, times the gain.
    EXPECT_NEAR((calc_rate_set_points(q, wanted, gains) - gains.per_rad.cwiseProduct(error)).norm(),
                0.0, 1e-8);
  }
}

TEST(AttitudeControlTest, TiltAloneGivesTwiceTheSineOfHalfTheAngle) {
  const AttitudeGains gains = make_unlimited();
  for (const double angle : {0.1, 1.0, 2.0, 3.0, -2.5}) {
    const Quaterniond wanted(AngleAxisd(angle, Vector3d::UnitX()));
    const Vector3d rates = calc_rate_set_points(Quaterniond::Identity(), wanted, gains);
    EXPECT_NEAR((rates - Vector3d(6.5 * 2.0 * std::sin(angle / 2), 0, 0)).norm(), 0.0, 1e-12);
  }
}

TEST(AttitudeControlTest, YawAloneIsWeighted) {
  const AttitudeGains gains = make_unlimited();
  for (const double angle : {0.1, 1.0, -2.0, 3.1}) {
    const Quaterniond wanted(AngleAxisd(angle, Vector3d::UnitZ()));
    const Vector3d rates = calc_rate_set_points(Quaterniond::Identity(), wanted, gains);
    EXPECT_NEAR((rates - Vector3d(0, 0, 2.8 / 0.4 * 2.0 * std::sin(0.4 * angle / 2))).norm(), 0.0,
                1e-12);
  }
}

TEST(AttitudeControlTest, WithoutYawWeightItTurnsTheZAxisTheShortestWay) {
  AttitudeGains gains = make_unlimited();
  gains.yaw_weight = 0.0;
  gains.per_rad.setOnes();
  std::mt19937_64 random(3);
  for (int i = 0; i < 100; ++i) {
    const Quaterniond q = make_random_attitude(random), wanted = make_random_attitude(random);
    const Vector3d axis_B = q.conjugate() * (wanted * Vector3d::UnitZ());
    const double angle = std::atan2(axis_B.head<2>().norm(), axis_B.z());
    const Vector3d expected =
        2.0 * std::sin(angle / 2) * Vector3d::UnitZ().cross(axis_B).normalized();
    EXPECT_NEAR((calc_rate_set_points(q, wanted, gains) - expected).norm(), 0.0, 1e-9);
  }
}

TEST(AttitudeControlTest, HalfATurnIsFiniteAndTurns) {
  const AttitudeGains gains;
  std::mt19937_64 random(4);
  for (int i = 0; i < 1000; ++i) {
    const Quaterniond q = make_random_attitude(random);
    Vector3d axis = make_random_vector(random);
    if (i % 3 == 0) axis.z() = 0.0;
    for (const double angle : {kPi, kPi - 1e-3, kPi - 1e-6, kPi - 1e-9, kPi + 1e-12}) {
      const Quaterniond wanted = q * Quaterniond(AngleAxisd(angle, axis.normalized()));
      const Vector3d rates = calc_rate_set_points(q, wanted, gains);
      ASSERT_TRUE(rates.allFinite());
      ASSERT_GT(rates.norm(), 1.0);
    }
  }
  for (const Vector3d& axis : {Vector3d(1, 0, 0), Vector3d(0, 1, 0), Vector3d(0, 0, 1)}) {
    const Quaterniond wanted(AngleAxisd(kPi, axis));
    ASSERT_GT(calc_rate_set_points(Quaterniond::Identity(), wanted, gains).norm(), 1.0);
  }
}

TEST(AttitudeControlTest, KeepsToItsLimits) {
  const AttitudeGains gains;
  std::mt19937_64 random(5);
  int limited = 0;
  for (int i = 0; i < 1000; ++i) {
    const Vector3d rates =
        calc_rate_set_points(make_random_attitude(random), make_random_attitude(random), gains);
    for (int axis = 0; axis < 3; ++axis) {
      ASSERT_LE(std::abs(rates[axis]), gains.rate_limits[axis]);
      limited += std::abs(rates[axis]) == gains.rate_limits[axis];
    }
  }
  EXPECT_GT(limited, 100);
}

TEST(AttitudeControlTest, TakesBothQuaternionsOfARotationAsOne) {
  const AttitudeGains gains;
  std::mt19937_64 random(6);
  for (int i = 0; i < 100; ++i) {
    const Quaterniond q = make_random_attitude(random), wanted = make_random_attitude(random);
    const Quaterniond minus(-wanted.coeffs());
    EXPECT_NEAR(
        (calc_rate_set_points(q, minus, gains) - calc_rate_set_points(q, wanted, gains)).norm(),
        0.0, 1e-12);
  }
}

TEST(AttitudeControlTest, IsTheSameForEveryHeading) {
  const AttitudeGains gains;
  std::mt19937_64 random(7);
  for (int i = 0; i < 100; ++i) {
    const Quaterniond q = make_random_attitude(random), wanted = make_random_attitude(random);
    const Quaterniond turn(AngleAxisd(0.07 * i, Vector3d::UnitZ()));
    EXPECT_NEAR((calc_rate_set_points(turn * q, turn * wanted, gains) -
                 calc_rate_set_points(q, wanted, gains))
                    .norm(),
                0.0, 1e-11);
  }
}

TEST(AttitudeControlTest, ABodyThatFollowsTheRatesArrivesFromAnywhere) {
  const AttitudeGains gains;
  std::mt19937_64 random(8);
  for (int i = 0; i < 100; ++i) {
    Quaterniond q = make_random_attitude(random);
    const Quaterniond wanted = make_random_attitude(random);
    for (int n = 0; n < 2000; ++n) {
      const Vector3d turned = 0.004 * calc_rate_set_points(q, wanted, gains);
      if (turned.norm() > 0.0)
        q = (q * Quaterniond(AngleAxisd(turned.norm(), turned.normalized()))).normalized();
    }
    EXPECT_LT(q.angularDistance(wanted), 1e-6);
  }
}

}  // namespace
}  // namespace sls::sim::px4
