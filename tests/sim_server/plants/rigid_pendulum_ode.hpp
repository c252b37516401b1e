/// The rigid pendulum as a closed-form ODE, derived only from Newton and Euler: an axisymmetric
/// body without spin, joined to a free point mass. It shares no equation with the plant.
///
///     m a_Q = m g e₃ + F − R,   M a_C = M g e₃ + R,   a_C = a_Q + c n̈,   I_C n × n̈ = −c n × R
///
/// R is the joint's force on the body, M its mass, c the distance of its centre C below the joint,
/// I_C its inertia about an axis across the rod through C. With μ = m M / (m + M):
///
///     R = μ (F / m + c n̈),   n̈ = −|ṅ|² n − c μ / (m (I_C + μ c²)) (F − n (n·F))
#pragma once

#include <Eigen/Core>

#include "tests/oracle/slung_load_ode.hpp"

namespace sls::oracle {

struct RigidPendulum {
  double quad_mass = 1.5;
  double gravity = 9.8;
  double mass = 0.001 + 0.2;
  double centre = (0.001 * 0.5 + 0.2 * 1.1) / (0.001 + 0.2);
  double inertia = 8.333e-4 + 0.001 * (centre - 0.5) * (centre - 0.5) +  //
                   8e-4 + 0.2 * (centre - 1.1) * (centre - 1.1);

  double total_mass() const { return quad_mass + mass; }
  double reduced_mass() const { return quad_mass * mass / total_mass(); }

  /// c μ / (m (I_C + μ c²)), 1 / (m L) for a point load.
  double calc_swing_factor() const {
    const double mu = reduced_mass();
    return centre * mu / (quad_mass * (inertia + mu * centre * centre));
  }
};

inline State calc_derivative(const State& state, const Eigen::Vector3d& f_Q_W,
                             const RigidPendulum& pendulum) {
  const Eigen::Vector3d f_across = f_Q_W - state.n_W * state.n_W.dot(f_Q_W);
  const Eigen::Vector3d n_ddot =
      -state.n_dot_W.squaredNorm() * state.n_W - pendulum.calc_swing_factor() * f_across;
  const Eigen::Vector3d joint_force =
      pendulum.reduced_mass() * (f_Q_W / pendulum.quad_mass + pendulum.centre * n_ddot);
  const Eigen::Vector3d a_WQ =
      Eigen::Vector3d(0.0, 0.0, pendulum.gravity) + (f_Q_W - joint_force) / pendulum.quad_mass;
  return {state.v_WQ, a_WQ, state.n_dot_W, n_ddot};
}

}  // namespace sls::oracle
