#include "control_client/saturation.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <limits>
#include <random>

namespace sls::control {
namespace {

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
