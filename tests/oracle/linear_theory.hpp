/// Predictions of linear theory for a flight, without simulation.
#pragma once

#include <Eigen/LU>
#include <cmath>
#include <complex>
#include <unsupported/Eigen/MatrixFunctions>
#include <vector>

#include "control_client/laws/qsf/lqr.hpp"
#include "sim_server/plants/slung_load/keys.hpp"
#include "tests/sim_server/plants/rigid_pendulum_ode.hpp"

namespace sls::oracle {

/// The solution e of the designed equation e⁽ⁿ⁾ = −Σ gains_i e⁽ⁱ⁾ from
/// `start` = (e, ė, …, e⁽ⁿ⁻¹⁾), at multiples of `h`.
inline std::vector<double> calc_designed_error(const Eigen::RowVectorXd& gains,
                                               Eigen::VectorXd start, double h, std::size_t count) {
  const Eigen::Index n = gains.size();
  Eigen::MatrixXd A = Eigen::MatrixXd::Zero(n, n);
  A.diagonal(1).setOnes();
  A.row(n - 1) = -gains;
  const Eigen::MatrixXd transition = (A * h).exp();
  std::vector<double> error;
  for (std::size_t i = 0; i < count; ++i) {
    error.push_back(start[0]);
    start = transition * start;
  }
  return error;
}

/// Steady load error of a figure eight, without transients: a sine about a mean on each axis.
struct SteadyError {
  Eigen::Array3d amplitude = Eigen::Array3d::Zero();
  Eigen::Array3d seen_amplitude = Eigen::Array3d::Zero();  ///< of the measured load
  Eigen::Array3d mean = Eigen::Array3d::Zero();
  Eigen::Array3d rms() const { return (amplitude.square() / 2 + mean.square()).sqrt(); }
  Eigen::Array3d seen_rms() const { return (seen_amplitude.square() / 2 + mean.square()).sqrt(); }
};

/// Steady error of small motions about hover, with drag, and with the force held over the period T:
///
///     horizontal  M p̈ + S q̈ = Z F − D (ṗ − v),   I q̈ + S p̈ + S g q = 0,   y = p + L q
///                 F = −M′ g′ q + (m′ L′ / g′) n [+ D (ṗ − v)],   n as in the law's (6) with
///                 ÿ = −g′ q, y⁽³⁾ = −g′ q̇ and the measured load at p + L′ q
///     vertical    M z̈ = M g − Z M′ (g′ − z̈_r + k_v ė′ + k_p e′),   e′ = e − (L − L′)
///     hold        Z = H(T) e^(−sd),   H(T) = (1 − e^(−sT)) / (sT)
///     sensing     F uses p e^(−sa) H(P) instead of p, and the same for q
///
/// M, S, I are the vehicle's mass and the pendulum's first and second moment about its joint. A
/// dash marks values of the controller's model. d is the delay of the node; P and a are the period
/// and age of the samples. Evaluated at s = iw, with the frequency of each axis.
inline SteadyError calc_steady_error(const config::Scenario& scenario,
                                     const config::FigureEightReference& eight) {
  using Complex = std::complex<double>;
  const model::SlungLoadParameters& vehicle = scenario.vehicle;
  const model::SlungLoadParameters& believed = scenario.controller.model.vehicle;
  const control::NamedGains gains =
      control::make_named_gains(scenario.controller.own.get<control::QsfKeys>().gains);
  const control::AxisGains &xy = gains.horizontal, &z = gains.vertical;
  const double mass = vehicle.total_mass(), length = vehicle.rod_length, g = vehicle.gravity;
  double first_moment = vehicle.load_mass * length, second_moment = first_moment * length;
  if (scenario.plant.own.get<sim::SlungLoadKeys>().pendulum == sim::Pendulum::kRigid) {
    const RigidPendulum links;
    first_moment = links.mass * links.centre;
    second_moment = links.inertia + first_moment * links.centre;
  }
  const double drag = scenario.plant.air.rotor_drag;
  const bool is_fed_forward = scenario.controller.drag_feed_forward;
  const double to_force = believed.quad_mass * believed.rod_length / believed.gravity;
  const double weight = believed.total_mass() * believed.gravity;
  const auto hold = [](const Complex& s, std::int64_t period_ns) {
    const Complex sT = s * (static_cast<double>(period_ns) * 1e-9);
    return period_ns == 0 ? 1.0 : (1.0 - std::exp(-sT)) / sT;
  };
  const auto delay = [](const Complex& s, std::int64_t by_ns) {
    return std::exp(-s * (static_cast<double>(by_ns) * 1e-9));
  };
  const config::Sensing& sensing = scenario.sensing;
  const auto calc_hold = [&](const Complex& s) {
    return hold(s, scenario.sync.period_ns) * delay(s, sensing.node_delay_ns);
  };
  const auto sample = [&](const Complex& s, const config::SampleTimes& times) {
    return hold(s, times.period_ns) * delay(s, times.age_ns);
  };
  SteadyError error;
  for (int axis = 0; axis < 2; ++axis) {
    const Complex s(0.0, 2.0 * M_PI * (axis + 1) / eight.period_s);
    const Complex held = calc_hold(s);
    const Complex seen_position = sample(s, sensing.body), seen_rod = sample(s, sensing.rod);
    const Complex of_error = xy.velocity * s + xy.position;  // part of −n
    const Complex by_position =
        ((is_fed_forward ? drag * s : 0.0) - to_force * of_error) * seen_position;
    const Complex by_rod = (to_force * (believed.gravity * (xy.jerk * s + xy.acceleration) -
                                        believed.rod_length * of_error) -
                            weight) *
                           seen_rod;
    const Complex by_reference =
        to_force * (s * s * (s * s + xy.jerk * s + xy.acceleration) + of_error);
    Eigen::Matrix2cd motion;
    motion << mass * s * s + drag * s - held * by_position, first_moment * s * s - held * by_rod,
        first_moment * s * s, second_moment * s * s + first_moment * g;
    const Eigen::Vector2cd response =
        motion.lu().solve(Eigen::Vector2cd(held * by_reference, Complex(0.0)));
    error.amplitude[axis] =
        std::abs(response[0] + length * response[1] - 1.0) * eight.amplitude[axis];
    error.seen_amplitude[axis] =
        std::abs(seen_position * response[0] + length * seen_rod * response[1] - 1.0) *
        eight.amplitude[axis];
    if (!is_fed_forward)
      error.mean[axis] = drag * scenario.plant.air.v_wind_W[axis] / (to_force * xy.position);
  }
  const Complex s(0.0, 2.0 * M_PI / eight.period_s);
  const Complex seen = sample(s, sensing.body), law = z.velocity * s + z.position;
  const double believed_mass = believed.total_mass();
  const Complex held = calc_hold(s) * believed_mass;
  const Complex height = held * (s * s + law) / (mass * s * s + held * seen * law);
  error.amplitude[2] = std::abs(height - 1.0) * eight.amplitude[2];
  error.seen_amplitude[2] = std::abs(seen * height - 1.0) * eight.amplitude[2];
  error.mean[2] = length - believed.rod_length + (mass * g - weight) / (believed_mass * z.position);
  return error;
}

}  // namespace sls::oracle
