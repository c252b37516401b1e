// Compares with closed forms the oracle that other tests use.
#include "tests/oracle/slung_load_ode.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <random>

#include "tests/support/random_vectors.hpp"

namespace sls::oracle {
namespace {

model::SlungLoadParameters make_vehicle() {
  model::SlungLoadParameters vehicle;
  vehicle.quad_mass = 1.3;
  vehicle.load_mass = 0.4;
  vehicle.rod_length = 0.7;
  vehicle.gravity = 9.81;
  return vehicle;
}

using test::draw_vector;

TEST(SlungLoadOdeTest, ObeysNewtonsLawsAndTheRodConstraint) {
  std::mt19937 generator(1);
  const model::SlungLoadParameters vehicle = make_vehicle();
  const Eigen::Vector3d g(0, 0, vehicle.gravity);
  for (int i = 0; i < 1000; ++i) {
    State state;
    state.n_W = draw_vector(generator, 1.0).normalized();
    state.n_dot_W = state.n_W.cross(draw_vector(generator, 3.0));
    const Eigen::Vector3d force = draw_vector(generator, 20.0);
    const Accelerations a = calc_accelerations(state, force, vehicle);
    // The rod does not act on the centre of mass.
    ASSERT_LE((1.3 * a.a_WQ + 0.4 * a.a_WL - 1.7 * g - force).norm(), 1e-12);
    // Only its weight and a force along the rod act on the load.
    ASSERT_LE((0.4 * (a.a_WL - g)).cross(state.n_W).norm(), 1e-12);
    // n · n̈ = −|ṅ|² keeps the rod's length.
    ASSERT_NEAR(state.n_W.dot(a.a_WL - a.a_WQ) / 0.7, -state.n_dot_W.squaredNorm(), 1e-11);
  }
}

TEST(SlungLoadOdeTest, CirclesAsAConicalPendulum) {
  // Ω² = (m + m_L) g / (m L cos θ): under the hover force the rod keeps its angle θ and turns, and
  // the quadrotor circles opposite to the load about their centre of mass.
  const model::SlungLoadParameters vehicle = make_vehicle();
  const double theta = 0.5;
  const double rate = std::sqrt(1.7 * 9.81 / (1.3 * 0.7 * std::cos(theta)));
  State state;
  state.n_W << std::sin(theta), 0.0, std::cos(theta);
  state.n_dot_W << 0.0, rate * std::sin(theta), 0.0;
  state.v_WQ = -0.4 / 1.7 * 0.7 * state.n_dot_W;
  const Eigen::Vector3d hover(0.0, 0.0, -1.7 * 9.81);
  for (int i = 0; i < 1000; ++i) {
    // The height is constant: the vertical acceleration is always zero.
    ASSERT_NEAR(calc_accelerations(state, hover, vehicle).a_WQ.z(), 0.0, 1e-8);
    state = rk4_step(state, hover, 1e-3, vehicle);
  }
  EXPECT_NEAR(state.n_W.z(), std::cos(theta), 1e-9);
  EXPECT_NEAR(std::remainder(std::atan2(state.n_W.y(), state.n_W.x()) - rate, 2 * M_PI), 0.0, 1e-8);
}

TEST(SlungLoadOdeTest, ConvergesWithTheFourthPowerOfTheStep) {
  const model::SlungLoadParameters vehicle = make_vehicle();
  const auto fly = [&](int steps) {
    State state;
    state.n_W = Eigen::Vector3d(0.3, -0.4, 0.8).normalized();
    state.n_dot_W = state.n_W.cross(Eigen::Vector3d(1.0, 2.0, -1.5));
    for (int i = 0; i < steps; ++i) {
      state = rk4_step(state, Eigen::Vector3d(3.0, 1.0, -20.0), 1.0 / steps, vehicle);
    }
    return Eigen::Vector3d(state.p_WQ + 0.7 * state.n_W);
  };
  const Eigen::Vector3d best = fly(3200);
  const double coarse = (fly(50) - best).norm(), fine = (fly(100) - best).norm();
  EXPECT_NEAR(std::log2(coarse / fine), 4.0, 0.3);
}

}  // namespace
}  // namespace sls::oracle
