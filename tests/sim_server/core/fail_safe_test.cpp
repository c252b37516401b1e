#include "sim_server/core/step/vehicle.hpp"

#include <gtest/gtest.h>

#include "sim_server/plants/slung_load/slung_load_plant.hpp"

namespace sls::sim {
namespace {

const model::SlungLoadParameters kVehicle{1.5, 0.2, 1.0, 9.8};

TEST(FailSafeTest, HoldsTheWeightAtRest) {
  EXPECT_EQ(calc_fail_safe_force(kVehicle, {}, 200.0), Eigen::Vector3d(0, 0, -1.7 * 9.8));
}

TEST(FailSafeTest, StaysWithinTheForceLimitInItsDirection) {
  model::SlungLoadState state;
  state.v_WQ = {0, 0, 10};
  const Eigen::Vector3d f_Q_W = calc_fail_safe_force(kVehicle, state, 20.0);
  EXPECT_NEAR(f_Q_W.norm(), 20.0, 1e-12);
  EXPECT_LT(f_Q_W.z(), 0.0);
}

/// Energy that remains if a force balances the weight: kinetic energy, and the potential energy of
/// the load relative to the quadrotor. Its rate is −(m + m_L) |v_WQ|² / τ.
double calc_remaining_energy(const model::SlungLoadState& state) {
  const double below = (state.p_WL - state.p_WQ).z();
  return 0.5 * kVehicle.quad_mass * state.v_WQ.squaredNorm() +
         0.5 * kVehicle.load_mass * state.v_WL.squaredNorm() +
         kVehicle.load_mass * kVehicle.gravity * (kVehicle.rod_length - below);
}

TEST(FailSafeTest, TakesTheEnergyOutOfAMovingVehicleWithASwingingLoad) {
  config::Plant settings;
  settings.initial.v_WQ = {2, -1, 1};
  settings.initial.rod = {0.4, -0.3, 0.5, 0.2};
  SlungLoadPlant plant(kVehicle, settings);
  const double initial = calc_remaining_energy(plant.state());
  double last = initial;
  for (int second = 0; second < 40; ++second) {
    for (int period = 0; period < 250; ++period) {  // held over 4 ms, as the server does
      const Eigen::Vector3d f_Q_W = calc_fail_safe_force(kVehicle, plant.state(), 200.0);
      for (int step = 0; step < 4; ++step) plant.step(f_Q_W);
    }
    const double energy = calc_remaining_energy(plant.state());
    EXPECT_LT(energy, last) << "at " << second << " s";
    last = energy;
  }
  EXPECT_LT(last, 1e-3 * initial);
}

}  // namespace
}  // namespace sls::sim
