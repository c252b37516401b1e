#include "control_client/drag_feed_forward.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <random>

#include "common/model/forces.hpp"
#include "tests/support/random_vectors.hpp"

namespace sls::control {
namespace {

using test::draw_vector;

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

TEST(DragFeedForwardTest, AgreesWithTheClosedFormInThePlane) {
  // Wanted force −N e₃, velocity u e₁: F = |F| (sin θ, 0, −cos θ). Normal to F: the drag is
  // D u cos θ = N sin θ, and tan θ = D u / N. Along F: |F| = N cos θ.
  const double N = 17.0, D = 0.4, u = 3.0;
  const double theta = std::atan2(D * u, N);
  const Eigen::Vector3d force =
      calc_drag_feed_forward({0.0, 0.0, -N}, {u, 0.0, 0.0}, {D, {0.0, 0.0, 0.0}});
  const Eigen::Vector3d expected =
      N * std::cos(theta) * Eigen::Vector3d(std::sin(theta), 0.0, -std::cos(theta));
  EXPECT_LE((force - expected).norm(), 1e-11);
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

}  // namespace
}  // namespace sls::control
