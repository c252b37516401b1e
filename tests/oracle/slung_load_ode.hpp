/// The ideal slung load as a closed-form ODE: an oracle for tests, derived only from Newton's
/// equations and the rod constraint. It shares no equation with the plant (Simbody) or the
/// controller.
///
///     m p̈ = m g e₃ + F + T n,   m_L p̈_L = m_L g e₃ − T n,   p_L = p + L n,   |n| = 1
///
/// The second derivative of n·n = 1 gives n·n̈ = −|ṅ|². The tension and both accelerations follow:
///
///     T = μ (L |ṅ|² − n·F / m),   μ = m m_L / (m + m_L)
///     a_Q = g e₃ + F / m + T n / m,   a_L = g e₃ − T n / m_L
///
/// F is the sum of all other forces on the quadrotor: control, drag, disturbance.
#pragma once

#include <Eigen/Core>

#include "common/model/parameters.hpp"
#include "common/model/state.hpp"

namespace sls::oracle {

/// Quadrotor and rod direction; the load follows from them.
struct State {
  Eigen::Vector3d p_WQ = Eigen::Vector3d::Zero();
  Eigen::Vector3d v_WQ = Eigen::Vector3d::Zero();
  Eigen::Vector3d n_W = Eigen::Vector3d::UnitZ();     ///< unit vector Q→L
  Eigen::Vector3d n_dot_W = Eigen::Vector3d::Zero();  ///< n_W · n_dot_W = 0
};

struct Accelerations {
  Eigen::Vector3d a_WQ;  ///< m/s²
  Eigen::Vector3d a_WL;  ///< m/s²
  double tension = 0.0;  ///< N, positive pulls
};

/// Accelerations under the total force `f_Q_W` on the quadrotor.
inline Accelerations calc_accelerations(const State& state, const Eigen::Vector3d& f_Q_W,
                                        const model::SlungLoadParameters& parameters) {
  const double m = parameters.quad_mass, m_L = parameters.load_mass;
  const double mu = m * m_L / (m + m_L);
  const Eigen::Vector3d gravity_W(0.0, 0.0, parameters.gravity);
  Accelerations result;
  result.tension =
      mu * (parameters.rod_length * state.n_dot_W.squaredNorm() - state.n_W.dot(f_Q_W) / m);
  result.a_WQ = gravity_W + f_Q_W / m + result.tension / m * state.n_W;
  result.a_WL = gravity_W - result.tension / m_L * state.n_W;
  return result;
}

/// Time derivative of a state: each member holds the derivative of the member with its name.
inline State calc_derivative(const State& state, const Eigen::Vector3d& f_Q_W,
                             const model::SlungLoadParameters& parameters) {
  const Accelerations a = calc_accelerations(state, f_Q_W, parameters);
  return {state.v_WQ, a.a_WQ, state.n_dot_W, (a.a_WL - a.a_WQ) / parameters.rod_length};
}

/// state + h · derivative, member by member; |n_W| is not restored.
inline State advance(const State& state, const State& derivative, double h) {
  return {state.p_WQ + h * derivative.p_WQ, state.v_WQ + h * derivative.v_WQ,
          state.n_W + h * derivative.n_W, state.n_dot_W + h * derivative.n_dot_W};
}

/// One classical fourth-order Runge-Kutta step of `h` seconds under a force that may depend on time
/// and state: `force_at(tau, state)` is the total force `tau` seconds into the step.
/// The step violates the rod constraint to order h⁵ and restores it at its end.
template <typename ForceAt, typename Parameters>
State rk4_step_with(const State& state, const ForceAt& force_at, double h,
                    const Parameters& parameters) {
  const auto slope = [&](double tau, const State& at) {
    return calc_derivative(at, force_at(tau, at), parameters);
  };
  const State k1 = slope(0.0, state);
  const State k2 = slope(h / 2, advance(state, k1, h / 2));
  const State k3 = slope(h / 2, advance(state, k2, h / 2));
  const State k4 = slope(h, advance(state, k3, h));
  State next = advance(advance(state, k1, h / 6), k4, h / 6);
  next = advance(advance(next, k2, h / 3), k3, h / 3);
  next.n_W.normalize();
  next.n_dot_W -= next.n_W * next.n_W.dot(next.n_dot_W);
  return next;
}

/// The same with a constant force (zero-order hold).
template <typename Parameters>
State rk4_step(const State& state, const Eigen::Vector3d& f_Q_W, double h,
               const Parameters& parameters) {
  return rk4_step_with(
      state, [&](double, const State&) { return f_Q_W; }, h, parameters);
}

/// Converts the oracle's state to the model's state.
inline model::SlungLoadState to_model_state(const State& state, double rod_length) {
  return model::make_state(state.p_WQ, state.v_WQ, state.p_WQ + rod_length * state.n_W,
                           state.v_WQ + rod_length * state.n_dot_W);
}

/// Converts the model's state to the oracle's; the rod's length is the distance of the bodies.
inline State from_model_state(const model::SlungLoadState& sample) {
  const double length = (sample.p_WL - sample.p_WQ).norm();
  return {sample.p_WQ, sample.v_WQ, (sample.p_WL - sample.p_WQ) / length,
          (sample.v_WL - sample.v_WQ) / length};
}

}  // namespace sls::oracle
