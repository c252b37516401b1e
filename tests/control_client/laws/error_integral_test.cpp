#include "control_client/laws/error_integral.hpp"

#include <gtest/gtest.h>

namespace sls::control {
namespace {

using Eigen::Vector3d;

TEST(ErrorIntegralTest, AdvancesByForwardEuler) {
  EXPECT_EQ(calc_next_integral({1.0, -2.0, 0.0}, {0.5, 0.25, -4.0}, 0.25),
            Vector3d(1.125, -1.9375, -1.0));
}

TEST(ErrorIntegralTest, StopsAtTheLimitOfEachAxisAndComesBack) {
  Vector3d integral(19.9, -19.9, 0.0);
  for (int i = 0; i < 100; ++i) integral = calc_next_integral(integral, {1.0, -1.0, 0.5}, 0.25);
  EXPECT_EQ(integral, Vector3d(20.0, -20.0, 12.5));
  EXPECT_EQ(calc_next_integral(integral, {-1.0, 1.0, 0.0}, 0.25), Vector3d(19.75, -19.75, 12.5));
}

TEST(ErrorIntegralTest, IsClampedOnlyAtTheLimitAndPushedOutwards) {
  EXPECT_TRUE(is_clamped(20.0, 0.1));
  EXPECT_TRUE(is_clamped(-20.0, -0.1));
  EXPECT_FALSE(is_clamped(20.0, -0.1));
  EXPECT_FALSE(is_clamped(-20.0, 0.1));
  EXPECT_FALSE(is_clamped(19.999, 0.1));
  EXPECT_FALSE(is_clamped(20.0, 0.0));
}

}  // namespace
}  // namespace sls::control
