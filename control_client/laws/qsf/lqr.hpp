/// Gains from the linear quadratic regulator. Source: README.md, eq. (11).
#pragma once

#include <Eigen/Core>

#include "control_client/laws/qsf/keys.hpp"

namespace sls::control {

/// LQR gains of a chain of `order` integrators with Q = weight · I and R = 1, lowest derivative
/// first: position, velocity, acceleration, jerk, …
/// @throws std::domain_error if `order` < 1, `weight` is not positive and finite, or the Riccati
/// equation could not be solved.
Eigen::VectorXd calc_lqr_chain_gains(int order, double weight);

/// Solution P of AᵀP + PA − P b bᵀ P + Q = 0 that makes A − b bᵀP stable. Q is positive definite.
/// @throws std::domain_error if there is none.
Eigen::MatrixXd solve_riccati(const Eigen::MatrixXd& A, const Eigen::VectorXd& b,
                              const Eigen::MatrixXd& Q);

/// The gains in force: LQR weights are solved (chains of 4 and 2), named gains stay as they are.
/// @throws config::ConfigError if the weights have no solution.
NamedGains make_named_gains(const Gains& gains);

}  // namespace sls::control
