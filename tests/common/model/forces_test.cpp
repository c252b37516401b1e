#include "common/model/forces.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <random>

#include "tests/support/random_vectors.hpp"

namespace sls::model {
namespace {

using test::draw_vector;

TEST(RotorDragTest, IsNormalToTheControlForceAndBrakesWithoutWind) {
  std::mt19937 generator(1);
  for (int i = 0; i < 10000; ++i) {
    const Aerodynamics air{0.3, Eigen::Vector3d::Zero()};
    const Eigen::Vector3d force = draw_vector(generator, 20.0), v = draw_vector(generator, 5.0);
    const Eigen::Vector3d drag = calc_rotor_drag(force, v, air);
    ASSERT_NEAR(drag.dot(force), 0.0, 1e-14 * v.norm() * force.norm());  // a few roundings
    ASSERT_LE(drag.dot(v), 1e-15 * v.squaredNorm());
    // Pythagoras: the components normal to the force and along it give the whole velocity.
    const double along = v.dot(force) / force.norm();
    ASSERT_NEAR(drag.squaredNorm() / (0.3 * 0.3) + along * along, v.squaredNorm(),
                1e-13 * v.squaredNorm());
  }
}

TEST(RotorDragTest, ActsOnTheVelocityRelativeToTheAir) {
  std::mt19937 generator(2);
  for (int i = 0; i < 1000; ++i) {
    const Eigen::Vector3d force = draw_vector(generator, 20.0), v = draw_vector(generator, 5.0);
    const Eigen::Vector3d wind = draw_vector(generator, 5.0);
    EXPECT_TRUE(calc_rotor_drag(force, wind, {0.3, wind}).isZero(0.0));
    EXPECT_TRUE(calc_rotor_drag(force, v, {0.3, wind})
                    .isApprox(calc_rotor_drag(force, v - wind, {0.3, {0, 0, 0}}), 1e-14));
  }
}

TEST(RotorDragTest, TakesAllOfALateralAndNothingOfAnAxialVelocity) {
  const Aerodynamics air{0.5, Eigen::Vector3d::Zero()};
  const Eigen::Vector3d hover(0.0, 0.0, -17.0);
  EXPECT_EQ(calc_rotor_drag(hover, {2.0, 0.0, 0.0}, air), Eigen::Vector3d(-1.0, 0.0, 0.0));
  EXPECT_EQ(calc_rotor_drag(hover, {0.0, 0.0, 3.0}, air), Eigen::Vector3d::Zero());
}

TEST(RotorDragTest, IsZeroWithoutACoefficientAndWithoutAForce) {
  const Eigen::Vector3d v(1.0, 2.0, 3.0);
  EXPECT_EQ(calc_rotor_drag({1.0, 0.0, -9.0}, v, {}), Eigen::Vector3d::Zero());
  EXPECT_EQ(calc_rotor_drag({0.0, 0.0, 0.0}, v, {0.3, {0, 0, 0}}), Eigen::Vector3d::Zero());
}

TEST(CommandedAttitudeTest, ReproducesTheForceThroughRotationMatrices) {
  std::mt19937 generator(3);
  for (int i = 0; i < 10000; ++i) {
    const Eigen::Vector3d force = draw_vector(generator, 20.0);
    const CommandedAttitude attitude = calc_commanded_attitude(force);
    const Eigen::Matrix3d R = (Eigen::AngleAxisd(attitude.yaw, Eigen::Vector3d::UnitZ()) *
                               Eigen::AngleAxisd(attitude.pitch, Eigen::Vector3d::UnitY()) *
                               Eigen::AngleAxisd(attitude.roll, Eigen::Vector3d::UnitX()))
                                  .toRotationMatrix();
    // Near a roll of a right angle asin loses half the digits; the force loses fewer.
    ASSERT_LE((-force.norm() * R * Eigen::Vector3d::UnitZ() - force).norm(), 1e-13 * force.norm());
    ASSERT_EQ(attitude.yaw, 0.0);
  }
}

TEST(CommandedAttitudeTest, IsLevelInHoverAndWithoutAForce) {
  for (const Eigen::Vector3d& force : {Eigen::Vector3d(0, 0, -17), Eigen::Vector3d(0, 0, 0)}) {
    const CommandedAttitude attitude = calc_commanded_attitude(force);
    EXPECT_EQ(attitude.roll, 0.0);
    EXPECT_EQ(attitude.pitch, 0.0);
  }
}

TEST(CommandedAttitudeTest, NoseDownFliesForwardAndRightSideDownFliesRight) {
  EXPECT_LT(calc_commanded_attitude({1.0, 0.0, -17.0}).pitch, 0.0);
  EXPECT_GT(calc_commanded_attitude({0.0, 1.0, -17.0}).roll, 0.0);
}

}  // namespace
}  // namespace sls::model
