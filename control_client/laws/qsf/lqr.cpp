#include "control_client/laws/qsf/lqr.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <Eigen/QR>
#include <cmath>
#include <sstream>
#include <stdexcept>
#include <string>

#include "common/model/math.hpp"

namespace sls::control {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// sign(H): the same eigenvectors, eigenvalues ±1 by the sign of the real part. Newton's iteration,
/// scaled by the determinant. It also works with double eigenvalues, such as those of a chain of
/// two with weight 4, where a computation by eigenvectors fails.
MatrixXd calc_matrix_sign(const MatrixXd& H) {
  const double size = static_cast<double>(H.rows());
  MatrixXd Z = H;
  for (int iteration = 0; iteration < 100; ++iteration) {
    const Eigen::PartialPivLU<MatrixXd> lu(Z);
    const double log_determinant = lu.matrixLU().diagonal().cwiseAbs().unaryExpr(&math::log).sum();
    const double scale = math::exp(-log_determinant / size);
    const MatrixXd next = 0.5 * (scale * Z + lu.inverse() / scale);
    if (!next.allFinite()) break;
    const double change = (next - Z).norm();
    Z = next;
    if (change <= 1e-12 * Z.norm()) return Z;
  }
  throw std::domain_error("the Riccati equation has no stabilising solution");
}

/// P of (A − b K)ᵀ P + P (A − b K) = −(Q + Kᵀ K), written as one linear system over vec(P).
MatrixXd solve_lyapunov(const MatrixXd& A_closed, const MatrixXd& Q_closed) {
  const Index n = A_closed.rows();
  MatrixXd system = MatrixXd::Zero(n * n, n * n);
  for (Index block = 0; block < n; ++block) {
    system.block(block * n, block * n, n, n) += A_closed.transpose();
    for (Index other = 0; other < n; ++other) {
      system.block(block * n, other * n, n, n).diagonal().array() += A_closed(other, block);
    }
  }
  const VectorXd right = -Eigen::Map<const VectorXd>(Q_closed.data(), n * n);
  const VectorXd solution = system.partialPivLu().solve(right);
  const MatrixXd P = Eigen::Map<const MatrixXd>(solution.data(), n, n);
  return 0.5 * (P + P.transpose());
}

}  // namespace

MatrixXd solve_riccati(const MatrixXd& A, const VectorXd& b, const MatrixXd& Q) {
  const Index n = A.rows();
  MatrixXd hamiltonian(2 * n, 2 * n);
  hamiltonian << A, -b * b.transpose(), -Q, -A.transpose();
  // Eq. (11): the columns of (I; P) span the stable subspace, which sign(H) + I maps to zero.
  const MatrixXd sign_plus_one = calc_matrix_sign(hamiltonian) + MatrixXd::Identity(2 * n, 2 * n);
  MatrixXd P = sign_plus_one.rightCols(n).colPivHouseholderQr().solve(-sign_plus_one.leftCols(n));
  // Two Newton steps (Kleinman) remove the rounding of the subspace.
  for (int polish = 0; polish < 2; ++polish) {
    const Eigen::RowVectorXd K = b.transpose() * P;
    P = solve_lyapunov(A - b * K, Q + K.transpose() * K);
  }
  const VectorXd K = P * b;
  const MatrixXd residual = A.transpose() * P + P * A - K * K.transpose() + Q;
  const double size = (P * A).norm() + K.squaredNorm() + Q.norm();
  // Lyapunov: with Q > 0 the closed loop is stable if and only if P > 0.
  if (!(residual.norm() <= 1e-9 * size) || P.llt().info() != Eigen::Success) {
    throw std::domain_error("the Riccati equation has no stabilising solution");
  }
  return P;
}

VectorXd calc_lqr_chain_gains(int order, double weight) {
  if (order < 1) throw std::domain_error("expected a chain of at least one integrator");
  if (!(weight > 0.0) || !std::isfinite(weight)) {
    throw std::domain_error("expected a finite weight > 0");
  }
  MatrixXd A = MatrixXd::Zero(order, order);
  A.diagonal(1).setOnes();
  const VectorXd b = VectorXd::Unit(order, order - 1);
  return solve_riccati(A, b, weight * MatrixXd::Identity(order, order)) * b;  // R = 1: K = bᵀ P
}

NamedGains make_named_gains(const Gains& gains) {
  if (const auto* named = std::get_if<NamedGains>(&gains)) return *named;
  const auto& weights = std::get<LqrWeights>(gains);
  const auto solve = [](const std::string& axis, int order, double weight) {
    try {
      return calc_lqr_chain_gains(order, weight);
    } catch (const std::domain_error& error) {
      std::ostringstream message;
      message << "controller.gains.lqr." << axis << ": expected a finite weight > 0 with a Riccati "
              << "solution, got " << weight << " (" << error.what() << ")";
      throw config::ConfigError(message.str());
    }
  };
  const VectorXd horizontal = solve("horizontal", 4, weights.horizontal);
  const VectorXd vertical = solve("vertical", 2, weights.vertical);
  NamedGains named;
  named.horizontal.position = horizontal[0];
  named.horizontal.velocity = horizontal[1];
  named.horizontal.acceleration = horizontal[2];
  named.horizontal.jerk = horizontal[3];
  named.vertical.position = vertical[0];
  named.vertical.velocity = vertical[1];
  return named;
}

}  // namespace sls::control
