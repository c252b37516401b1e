#include "control_client/laws/qsf/lqr.hpp"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <cmath>
#include <limits>
#include <stdexcept>

namespace sls::control {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

struct Chain {
  MatrixXd A;
  VectorXd b;
};

Chain make_chain(int order) {
  Chain chain{MatrixXd::Zero(order, order), VectorXd::Zero(order)};
  for (int i = 0; i + 1 < order; ++i) chain.A(i, i + 1) = 1.0;
  chain.b[order - 1] = 1.0;
  return chain;
}

TEST(LqrTest, GivesTheNumbersOfTheDesign) {
  // Design 4 prints four or five digits.
  const VectorXd slow4 = calc_lqr_chain_gains(4, 10.0);
  EXPECT_NEAR(slow4[0], 3.1623, 5e-5);
  EXPECT_NEAR(slow4[1], 8.4827, 5e-5);
  EXPECT_NEAR(slow4[2], 9.7962, 5e-5);
  EXPECT_NEAR(slow4[3], 5.4399, 5e-5);
  const VectorXd fast4 = calc_lqr_chain_gains(4, 1000.0);
  EXPECT_NEAR(fast4[0], 31.623, 5e-4);
  EXPECT_NEAR(fast4[1], 77.326, 5e-4);
  EXPECT_NEAR(fast4[2], 78.729, 5e-4);
  EXPECT_NEAR(fast4[3], 34.021, 5e-4);
  const VectorXd slow2 = calc_lqr_chain_gains(2, 5.0);
  EXPECT_NEAR(slow2[0], 2.2361, 5e-5);
  EXPECT_NEAR(slow2[1], 3.0777, 5e-5);
  const VectorXd fast2 = calc_lqr_chain_gains(2, 50.0);
  EXPECT_NEAR(fast2[0], 7.0711, 5e-5);
  EXPECT_NEAR(fast2[1], 8.0089, 5e-5);
}

TEST(LqrTest, AgreesWithTheClosedFormsOfShortChains) {
  // One integrator: √q. Two: √q and √(q + 2 √q). Weight 4 makes the poles of two coincide.
  for (const double weight : {1e-6, 0.3, 1.0, 4.0, 5.0, 50.0, 1e6}) {
    const VectorXd one = calc_lqr_chain_gains(1, weight), two = calc_lqr_chain_gains(2, weight);
    const double root = std::sqrt(weight);
    EXPECT_NEAR(one[0], root, 1e-12 * root);
    EXPECT_NEAR(two[0], root, 1e-12 * root);
    const double velocity = std::sqrt(weight + 2.0 * root);
    EXPECT_NEAR(two[1], velocity, 1e-12 * velocity);
  }
}

TEST(LqrTest, SolvesTheRiccatiEquationWithASymmetricPositiveMatrix) {
  for (int order = 1; order <= 8; ++order) {
    for (const double weight : {1e-3, 1.0, 10.0, 1000.0, 1e6}) {
      const Chain chain = make_chain(order);
      const MatrixXd Q = weight * MatrixXd::Identity(order, order);
      const MatrixXd P = solve_riccati(chain.A, chain.b, Q);
      const MatrixXd quadratic = P * chain.b * chain.b.transpose() * P;
      const MatrixXd residual = chain.A.transpose() * P + P * chain.A - quadratic + Q;
      // The solver is backward stable: a few dozen roundings of the terms that cancel.
      EXPECT_LE(residual.norm(), 1e-12 * (quadratic.norm() + Q.norm() + P.norm()))
          << order << " " << weight;
      EXPECT_LE((P - P.transpose()).norm(), 1e-14 * P.norm());
      EXPECT_GT(Eigen::SelfAdjointEigenSolver<MatrixXd>(P).eigenvalues().minCoeff(), 0.0);
      const MatrixXd closed = chain.A - chain.b * chain.b.transpose() * P;
      EXPECT_LT(closed.eigenvalues().real().maxCoeff(), 0.0);
    }
  }
}

TEST(LqrTest, ClosedLoopIsTheSpectralFactorOfTheCost) {
  // Independent of any Riccati equation: with p(s) the closed loop's characteristic polynomial,
  // p(s) p(−s) = (−s²)ⁿ + q Σₖ₌₀ⁿ⁻¹ (−s²)ᵏ.
  for (int order = 1; order <= 8; ++order) {
    for (const double weight : {1e-3, 1.0, 10.0, 1000.0, 1e6}) {
      const VectorXd gains = calc_lqr_chain_gains(order, weight);
      VectorXd p(order + 1);
      p << gains, 1.0;
      for (int power = 0; power <= 2 * order; ++power) {
        double coefficient = 0.0, size = 0.0;
        for (int i = 0; i <= order; ++i) {
          const int j = power - i;
          if (j < 0 || j > order) continue;
          coefficient += p[i] * p[j] * (j % 2 == 0 ? 1.0 : -1.0);
          size += std::abs(p[i] * p[j]);
        }
        const double sign = (power / 2) % 2 == 0 ? 1.0 : -1.0;
        const double expected = power % 2 != 0 ? 0.0 : sign * (power == 2 * order ? 1.0 : weight);
        EXPECT_NEAR(coefficient, expected, 1e-11 * size) << order << " " << weight << " " << power;
      }
    }
  }
}

TEST(LqrTest, RefusesProblemsWithoutASolution) {
  EXPECT_THROW(calc_lqr_chain_gains(0, 1.0), std::domain_error);
  for (const double weight : {0.0, -1.0, std::numeric_limits<double>::quiet_NaN(),
                              std::numeric_limits<double>::infinity()}) {
    EXPECT_THROW(calc_lqr_chain_gains(4, weight), std::domain_error);
    EXPECT_THROW(make_named_gains(LqrWeights{weight, 5.0}), config::ConfigError);
    EXPECT_THROW(make_named_gains(LqrWeights{10.0, weight}), config::ConfigError);
  }
  // An unstable mode that the input does not reach.
  EXPECT_THROW(
      solve_riccati(MatrixXd::Identity(2, 2), VectorXd::Unit(2, 0), MatrixXd::Identity(2, 2)),
      std::domain_error);
}

TEST(LqrTest, WeightsBecomeNamedGainsAndNamedGainsStay) {
  const NamedGains solved = make_named_gains(LqrWeights{10.0, 5.0});
  const VectorXd four = calc_lqr_chain_gains(4, 10.0), two = calc_lqr_chain_gains(2, 5.0);
  EXPECT_EQ(solved.horizontal.position, four[0]);
  EXPECT_EQ(solved.horizontal.velocity, four[1]);
  EXPECT_EQ(solved.horizontal.acceleration, four[2]);
  EXPECT_EQ(solved.horizontal.jerk, four[3]);
  EXPECT_EQ(solved.horizontal.integral, 0.0);
  EXPECT_EQ(solved.vertical.position, two[0]);
  EXPECT_EQ(solved.vertical.velocity, two[1]);
  EXPECT_EQ(solved.vertical.integral, 0.0);

  NamedGains named;
  named.horizontal = {1.0, 2.0, 3.0, 4.0, 5.0};
  named.vertical = {6.0, 7.0, 0.0, 0.0, 8.0};
  const NamedGains kept = make_named_gains(named);
  EXPECT_EQ(kept.horizontal.jerk, 4.0);
  EXPECT_EQ(kept.horizontal.integral, 5.0);
  EXPECT_EQ(kept.vertical.position, 6.0);
  EXPECT_EQ(kept.vertical.integral, 8.0);
}

}  // namespace
}  // namespace sls::control
