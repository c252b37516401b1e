// Compares the conversion from z down to z up with closed forms.
#include "common/ros/frames.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace sls::ros {
namespace {

using Eigen::AngleAxisd;
using Eigen::Matrix3d;
using Eigen::Quaterniond;
using Eigen::Vector3d;

constexpr double kRounding = 1e-15;  // of sums of three products of numbers up to 1

Quaterniond make_attitude(double roll, double pitch, double yaw) {
  return AngleAxisd(yaw, Vector3d::UnitZ()) * AngleAxisd(pitch, Vector3d::UnitY()) *
         AngleAxisd(roll, Vector3d::UnitX());
}

TEST(FramesTest, ForwardStaysForwardRightBecomesMinusLeftDownBecomesMinusUp) {
  EXPECT_EQ(to_ros(Vector3d(1, 2, 3)), Vector3d(1, -2, -3));
}

TEST(FramesTest, LeavesNoMinusZero) {
  const Vector3d zero = to_ros(Vector3d(-0.0, 0, 0));
  for (const double number : zero) EXPECT_FALSE(std::signbit(number));
  const Quaterniond level = to_ros(Quaterniond(1, -0.0, 0, 0));
  for (const double number : level.coeffs()) EXPECT_FALSE(std::signbit(number));
}

TEST(FramesTest, KeepsHandedness) {
  const Vector3d a(1, 2, 3), b(-4, 5, 0.5);
  EXPECT_EQ(to_ros(a).cross(to_ros(b)), to_ros(a.cross(b)));
}

TEST(FramesTest, AHalfTurnAboutXDoesTheSameAndUndoesIt) {
  const Vector3d v(1, 2, 3);
  EXPECT_EQ(half_turn_about_x() * v, to_ros(v));
  EXPECT_EQ(to_ros(to_ros(v)), v);
}

TEST(FramesTest, ARotatedVectorIsTheSameWhetherItIsRotatedInWOrInWorld) {
  for (const double roll : {-3.0, -0.4, 0.0, 1.1})
    for (const double pitch : {-1.5, 0.0, 0.7})
      for (const double yaw : {-2.0, 0.0, 3.1}) {
        const Quaterniond q_WB = make_attitude(roll, pitch, yaw);
        const Vector3d v_B(0.3, -0.5, 0.8);
        EXPECT_LT((to_ros(q_WB * v_B) - to_ros(q_WB) * to_ros(v_B)).norm(), kRounding);
        const Matrix3d rotation = to_ros(q_WB).toRotationMatrix();
        EXPECT_NEAR(rotation.determinant(), 1, 3 * kRounding);
      }
}

TEST(FramesTest, RollStaysPitchAndYawChangeTheirSign) {
  for (const double angle : {-0.5, 0.2, 2.0}) {
    EXPECT_TRUE(to_ros(make_attitude(angle, 0, 0)).isApprox(make_attitude(angle, 0, 0)));
    EXPECT_TRUE(to_ros(make_attitude(0, angle, 0)).isApprox(make_attitude(0, -angle, 0)));
    EXPECT_TRUE(to_ros(make_attitude(0, 0, angle)).isApprox(make_attitude(0, 0, -angle)));
  }
}

TEST(FramesTest, AQuarterTurnToTheRightPointsForwardToMinusY) {
  const Quaterniond q_WB(AngleAxisd(M_PI / 2, Vector3d::UnitZ()));  // down: to the right
  EXPECT_LT((to_ros(q_WB) * Vector3d::UnitX() - Vector3d(0, -1, 0)).norm(), kRounding);
}

}  // namespace
}  // namespace sls::ros
