#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "sim_server/plants/slung_load/keys.hpp"
#include "sim_server/plants/slung_load/rigid_links.hpp"
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

std::string get_refusal(const model::SlungLoadParameters& vehicle) {
  try {
    SlungLoadPlant plant(vehicle, make_rigid_plant());
  } catch (const config::ConfigError& error) {
    return error.what();
  }
  return "accepted";
}

TEST(RigidPendulumTest, RefusesAVehicleThatContradictsTheLinks) {
  using testing::EndsWith, testing::StartsWith;
  model::SlungLoadParameters vehicle = make_rigid_vehicle();
  vehicle.rod_length = 1.0;
  EXPECT_THAT(get_refusal(vehicle), StartsWith("vehicle.rod_length_m: expected 1.1 "));
  EXPECT_THAT(get_refusal(vehicle), EndsWith(", got 1"));
  vehicle = make_rigid_vehicle();
  vehicle.load_mass = 0.25;
  EXPECT_THAT(get_refusal(vehicle), StartsWith("vehicle.load_mass_kg: expected 0.2 or 0.201 "));
  EXPECT_THAT(get_refusal(vehicle), EndsWith(", got 0.25"));
  vehicle = make_rigid_vehicle();
  vehicle.quad_mass = 1.6;
  EXPECT_THAT(get_refusal(vehicle), StartsWith("vehicle.quad_mass_kg: expected 1.5 "));
  EXPECT_THAT(get_refusal(vehicle), EndsWith(", got 1.6"));
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

TEST(RigidPendulumTest, IdealPlantTakesAnyVehicle) {
  EXPECT_THROW(check_rigid_vehicle(model::SlungLoadParameters{}), config::ConfigError);
  EXPECT_NO_THROW(SlungLoadPlant(model::SlungLoadParameters{}, config::Plant{}));
}

TEST(RigidPendulumTest, StaysWhereItHoversAtItsLinksWeight) {
  const oracle::RigidPendulum links;
  SlungLoadPlant plant(make_rigid_vehicle(), make_rigid_plant());
  fly(plant, calc_weight_force(1.5 + 0.001 + 0.2, links.gravity), 10'000);
  // Rounding of the weight (2e-15 N of 17 N) over 10 s: ½ · 1e-15 · 100.
  EXPECT_NEAR(plant.state().p_WL.z(), 0.0, 1e-12);
  EXPECT_EQ(plant.state().p_WL.x(), 0.0);
  EXPECT_NEAR(plant.state().p_WQ.z(), -1.1, 1e-12);
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
  // The plant's truncation error is (ωh)⁴/120 = 1e-12 per radian. As for the ideal load, the errors
  // are the same on every machine: 5.18e-11, 1.19e-10.
  EXPECT_LE(position_error, 5.2e-11);
  EXPECT_LE(velocity_error, 1.2e-10);
}

TEST(RigidPendulumTest, KeepsEnergyLessTheHeldForcesWork) {
  const oracle::RigidPendulum links;
  config::Plant config = make_rigid_plant();
  config.initial.rod = {0.4, -0.3, 0.5, 2.0};
  SlungLoadPlant plant(make_rigid_vehicle(), config);
  const Eigen::Vector3d f_Q_W(0.3, -0.2, -16.0);
  const auto calc_invariant = [&] {
    const model::SlungLoadState state = plant.state();
    return oracle::calc_energy(oracle::from_model_state(state), links) - f_Q_W.dot(state.p_WQ);
  };
  const double start = calc_invariant();
  fly(plant, f_Q_W, 8000);
  // Runge-Kutta changes the invariant by (ωh)⁶/72 ≈ 2e-17 of 1 J per step; 8,000 roundings of 600 J
  // are larger.
  EXPECT_NEAR(calc_invariant(), start, 1e-10);
}

}  // namespace
}  // namespace sls::sim
