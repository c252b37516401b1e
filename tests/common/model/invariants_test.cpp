#include "common/model/invariants.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include "tests/oracle/slung_load_ode.hpp"

namespace sls::model {
namespace {

SlungLoadParameters make_vehicle() {
  SlungLoadParameters vehicle;
  vehicle.quad_mass = 1.3;
  vehicle.load_mass = 0.4;
  vehicle.rod_length = 0.7;
  vehicle.gravity = 9.81;
  return vehicle;
}

oracle::State make_start() {
  oracle::State state;
  state.p_WQ << 0.3, -0.2, -1.0;
  state.v_WQ << 0.5, -1.0, 0.2;
  state.n_W = Eigen::Vector3d(0.3, -0.4, 0.8).normalized();
  state.n_dot_W = state.n_W.cross(Eigen::Vector3d(1.0, 2.0, -1.5));
  return state;
}

TEST(InvariantsTest, EnergyGrowsByTheWorkOfTheForce) {
  const SlungLoadParameters vehicle = make_vehicle();
  const Eigen::Vector3d force(3.0, -2.0, -20.0);
  const oracle::State start = make_start();
  oracle::State state = start;
  for (int i = 0; i < 1000; ++i) state = oracle::rk4_step(state, force, 1e-3, vehicle);
  // A constant force does the work F · Δp.
  const double gain = calc_energy(oracle::to_model_state(state, 0.7), vehicle) -
                      calc_energy(oracle::to_model_state(start, 0.7), vehicle);
  // RK4 at 1 ms, rod at 3 rad/s: relative error (3e-3)⁴ per radian, over 3 rad, of some 40 J.
  EXPECT_NEAR(gain, force.dot(state.p_WQ - start.p_WQ), 1e-8);
}

TEST(InvariantsTest, MomentumGrowsByTheImpulseOfForceAndGravity) {
  const SlungLoadParameters vehicle = make_vehicle();
  const Eigen::Vector3d force(3.0, -2.0, -20.0);
  const oracle::State start = make_start();
  oracle::State state = start;
  for (int i = 0; i < 1000; ++i) state = oracle::rk4_step(state, force, 1e-3, vehicle);
  const Eigen::Vector3d gain = calc_momentum(oracle::to_model_state(state, 0.7), vehicle) -
                               calc_momentum(oracle::to_model_state(start, 0.7), vehicle);
  const Eigen::Vector3d impulse =
      force + Eigen::Vector3d(0.0, 0.0, vehicle.total_mass() * vehicle.gravity);
  EXPECT_LE((gain - impulse).norm(), 1e-9);  // RK4's order; rounding over 1,000 steps is 1e-12
}

TEST(InvariantsTest, HeightIsMinusZ) {
  const SlungLoadParameters vehicle = make_vehicle();
  const SlungLoadState low = make_state({0, 0, 0}, {0, 0, 0}, RodAngles{}, 0.7);
  const SlungLoadState high = make_state({0, 0, -1}, {0, 0, 0}, RodAngles{}, 0.7);
  EXPECT_NEAR(calc_energy(high, vehicle) - calc_energy(low, vehicle), 1.7 * 9.81, 1e-12);
}

TEST(InvariantsTest, RodErrorsAreDistanceAndSpeedAlongTheRod) {
  SlungLoadState state = make_state({0, 0, 0}, {0, 0, 0}, RodAngles{0.3, -0.2, 1.0, 2.0}, 0.7);
  EXPECT_NEAR(calc_rod_length_error(state, 0.7), 0.0, 1e-15);
  EXPECT_NEAR(calc_rod_length_error(state, 0.6), 0.1, 1e-15);
  EXPECT_NEAR(calc_rod_stretch_rate(state), 0.0, 1e-15);
  state.v_WL += 0.25 * to_direction(state.rod).n_W;
  EXPECT_NEAR(calc_rod_stretch_rate(state), 0.25, 1e-15);
}

}  // namespace
}  // namespace sls::model
