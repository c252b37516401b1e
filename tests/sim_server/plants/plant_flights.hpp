/// Flights that several plant tests share.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>

#include "common/config/scenario.hpp"
#include "common/model/state.hpp"
#include "sim_server/plants/slung_load/slung_load_plant.hpp"
#include "tests/oracle/slung_load_ode.hpp"

namespace sls::sim {

inline constexpr double kStep = 0.001;  ///< s, config::Plant's default

/// Force that carries quadrotor and pendulum, N.
inline Eigen::Vector3d calc_weight_force(double total_mass, double gravity) {
  return {0.0, 0.0, -total_mass * gravity};
}

inline void fly(SlungLoadPlant& plant, const Eigen::Vector3d& f_Q_W, int steps) {
  for (int k = 0; k < steps; ++k) plant.step(f_Q_W);
}

inline double calc_tilt(const Eigen::Vector3d& n_W) {
  return std::acos(std::clamp(n_W.normalized().z(), -1.0, 1.0));
}

/// Largest difference of any coordinate of the two bodies, m.
inline double calc_position_difference(const model::SlungLoadState& a,
                                       const model::SlungLoadState& b) {
  return std::max((a.p_WQ - b.p_WQ).cwiseAbs().maxCoeff(), (a.p_WL - b.p_WL).cwiseAbs().maxCoeff());
}

/// The same for velocities, m/s.
inline double calc_velocity_difference(const model::SlungLoadState& a,
                                       const model::SlungLoadState& b) {
  return std::max((a.v_WQ - b.v_WQ).cwiseAbs().maxCoeff(), (a.v_WL - b.v_WL).cwiseAbs().maxCoeff());
}

/// Control force that keeps the quadrotor near the origin and shakes the load in every direction
/// near its swing frequency: a smooth flight with tilts beyond 20 degrees.
inline Eigen::Vector3d calc_shaking_force(double time, const Eigen::Vector3d& p_WQ,
                                          const Eigen::Vector3d& v_WQ, double total_mass,
                                          double gravity) {
  const Eigen::Vector3d shake(2.0 * std::sin(2.9 * time), 1.6 * std::cos(2.6 * time),
                              3.0 * std::sin(1.3 * time));
  return calc_weight_force(total_mass, gravity) + shake - 2.0 * p_WQ - 2.0 * v_WQ;
}

/// Number of oracle steps per plant step. The oracle's truncation error is then 256 times smaller,
/// and the remaining difference is the plant's error.
inline constexpr int kOracleSubsteps = 4;

/// The oracle's flight over one plant step, with the ideal load or the rigid pendulum.
template <typename Parameters>
oracle::State fly_oracle(oracle::State state, const Eigen::Vector3d& f_Q_W,
                         const Parameters& parameters) {
  for (int i = 0; i < kOracleSubsteps; ++i) {
    state = rk4_step(state, f_Q_W, kStep / kOracleSubsteps, parameters);
  }
  return state;
}

/// A pendulum with β̈ = −ω² sin β from rest at `amplitude` first hangs vertically at this time, s.
inline double calc_quarter_period(double omega, double amplitude) {
  return std::comp_ellint_1(std::sin(amplitude / 2.0)) / omega;
}

/// Time at which β of `plant` under the held force first changes its sign, s: cubic Hermite
/// interpolation between the two steps around it, with an error of order h⁴.
inline double find_first_hang(SlungLoadPlant& plant, const Eigen::Vector3d& f_Q_W) {
  model::RodAngles before = plant.state().rod;
  for (int k = 0; k < 60'000; ++k) {
    plant.step(f_Q_W);
    const model::RodAngles after = plant.state().rod;
    if (after.beta <= 0.0) {
      double low = 0.0, high = 1.0;
      for (int i = 0; i < 60; ++i) {
        const double s = 0.5 * (low + high), r = 1.0 - s;
        const double beta = r * r * ((1.0 + 2.0 * s) * before.beta + s * kStep * before.beta_dot) +
                            s * s * ((1.0 + 2.0 * r) * after.beta - r * kStep * after.beta_dot);
        (beta > 0.0 ? low : high) = s;
      }
      return (k + low) * kStep;
    }
    before = after;
  }
  return std::nan("");
}

}  // namespace sls::sim
