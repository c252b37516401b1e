#include <gtest/gtest.h>

#include "sim_server/plants/slung_load/keys.hpp"
#include "tests/sim_server/plants/plant_flights.hpp"
#include "tests/sim_server/plants/rigid_pendulum_ode.hpp"

namespace sls::sim {
namespace {

model::SlungLoadParameters make_rigid_vehicle() {
  model::SlungLoadParameters vehicle;
  vehicle.rod_length = 1.1;
  return vehicle;
}

config::Plant make_rigid_plant() {
  config::Plant plant;
  plant.own = SlungLoadKeys{Pendulum::kRigid};
  return plant;
}

TEST(RigidPendulumTest, TakesTheLoadsMassAloneOrWithTheRod) {
  model::SlungLoadParameters with_rod = make_rigid_vehicle();
  with_rod.load_mass = 0.201;
  config::Plant config = make_rigid_plant();
  config.initial.rod.alpha = 0.3;
  SlungLoadPlant alone(make_rigid_vehicle(), config), together(with_rod, config);
  const Eigen::Vector3d f_Q_W(0.1, 0.2, -16.0);
  fly(alone, f_Q_W, 100);
  fly(together, f_Q_W, 100);
  // Only the links define the pendulum: the plant is the same to the last bit.
  EXPECT_EQ(calc_position_difference(alone.state(), together.state()), 0.0);
}

TEST(RigidPendulumTest, OnlyTheIdealPlantTakesAVehicleThatContradictsTheLinks) {
  const model::SlungLoadParameters other;  // what is wrong: RigidLinksTest
  EXPECT_THROW(SlungLoadPlant(other, make_rigid_plant()), config::ConfigError);
  EXPECT_NO_THROW(SlungLoadPlant(other, config::Plant{}));
}

// Under a vertical force equal to the weight the planar swing is exactly β̈ = −ω² sin β.
TEST(RigidPendulumTest, SwingsWithTheCompoundPendulumsPeriod) {
  const oracle::RigidPendulum links;
  const Eigen::Vector3d f_Q_W = calc_weight_force(links.total_mass(), links.gravity);
  const double omega = std::sqrt(-f_Q_W.z() * links.calc_swing_factor());
  for (const double amplitude : {0.01, 1.0}) {
    config::Plant config = make_rigid_plant();
    config.initial.rod.beta = amplitude;
    SlungLoadPlant plant(make_rigid_vehicle(), config);
    // Runge-Kutta's phase error is (ωh)⁴/120 ≈ 1e-12, the interpolation's h⁴ of the same size.
    EXPECT_NEAR(find_first_hang(plant, f_Q_W), calc_quarter_period(omega, amplitude), 1e-11);
  }
  // The rod's and the load's inertia change the frequency by 3e-3, far above the tolerance here.
  EXPECT_GT(std::abs(omega / std::sqrt(1.7 * 9.8 / (1.5 * 1.1)) - 1.0), 1e-4);
}

TEST(RigidPendulumTest, FollowsTheNewtonEulerEquationsForThirtyTwoSeconds) {
  const oracle::RigidPendulum links;
  config::Plant config = make_rigid_plant();
  config.initial.rod = {0.4, -0.3, 0.5, 1.0};
  config.initial.v_WQ = {0.3, -0.2, 0.1};
  SlungLoadPlant plant(make_rigid_vehicle(), config);
  oracle::State expected = oracle::from_model_state(plant.state());
  double position_error = 0.0, velocity_error = 0.0, tilt = 0.0;
  for (int k = 0; k < 32'000; ++k) {
    const Eigen::Vector3d f_Q_W = calc_shaking_force(k * kStep, expected.p_WQ, expected.v_WQ,
                                                     links.total_mass(), links.gravity);
    plant.step(f_Q_W);
    expected = fly_oracle(expected, f_Q_W, links);
    const model::SlungLoadState now = oracle::to_model_state(expected, 1.1);
    position_error = std::max(position_error, calc_position_difference(plant.state(), now));
    velocity_error = std::max(velocity_error, calc_velocity_difference(plant.state(), now));
    tilt = std::max(tilt, calc_tilt(expected.n_W));
  }
  EXPECT_GT(tilt, 20.0 * M_PI / 180.0);
  // The plant's truncation error is (ωh)⁴/120 = 1e-12 per radian. The errors are 5.18e-11
  // to 5.21e-11 and 1.19e-10: the force here comes from the C library's functions.
  EXPECT_LE(position_error, 5.3e-11);
  EXPECT_LE(velocity_error, 1.2e-10);
}

}  // namespace
}  // namespace sls::sim
