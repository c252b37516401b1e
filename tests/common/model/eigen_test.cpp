// The order in which Eigen adds and multiplies, written out: a version of Eigen with another order
// would move the bits of recordings. What only sets up a flight (QR and SVD) is judged by the
// certificates of scenarios (tools/systems).
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <random>
#include <utility>
#include <vector>

#include "common/model/dot.hpp"

namespace sls::model {
namespace {

using Eigen::Index, Eigen::Matrix3d, Eigen::MatrixXd, Eigen::Quaterniond, Eigen::Vector3d,
    Eigen::VectorXd;

class EigenTest : public testing::TestWithParam<unsigned> {
 protected:
  template <class Matrix>
  Matrix draw(Index rows = Matrix::RowsAtCompileTime, Index columns = Matrix::ColsAtCompileTime) {
    return Matrix::NullaryExpr(rows, columns, [this] { return number_(random_); });
  }

 private:
  std::mt19937_64 random_{GetParam()};
  std::uniform_real_distribution<double> number_{-3.0, 3.0};
};

/// The sum of numbers `from` to `to`: that of the first half plus that of the second.
double add_halves(const std::vector<double>& numbers, std::size_t from, std::size_t to) {
  if (to - from == 1) return numbers[from];
  const std::size_t middle = from + (to - from) / 2;
  return add_halves(numbers, from, middle) + add_halves(numbers, middle, to);
}

template <class A, class B>
double multiply(const A& a, const B& b) {
  std::vector<double> products;
  for (Index i = 0; i < a.size(); ++i) products.push_back(a(i) * b(i));
  return add_halves(products, 0, products.size());
}

TEST_P(EigenTest, SumsOfFixedSizeAreAddedInHalves) {
  const auto expect_halves = [](const auto& a, const auto& b) {
    EXPECT_EQ(dot(a, b), multiply(a, b));
    EXPECT_EQ(a.squaredNorm(), multiply(a, a));
    EXPECT_EQ(a.norm(), std::sqrt(multiply(a, a)));
    EXPECT_EQ(a.normalized(), a / std::sqrt(multiply(a, a)));
  };
  expect_halves(draw<Vector3d>(), draw<Vector3d>());
  expect_halves(draw<Eigen::Vector4d>(), draw<Eigen::Vector4d>());
  const Matrix3d a = draw<Matrix3d>(), b = draw<Matrix3d>();
  const Vector3d v = draw<Vector3d>();
  EXPECT_EQ(a.trace(), add_halves({a(0, 0), a(1, 1), a(2, 2)}, 0, 3));
  for (Index row = 0; row < 3; ++row) {
    EXPECT_EQ((a * v)(row), multiply(a.row(row), v));
    EXPECT_EQ((a.transpose() * v)(row), multiply(a.col(row), v));
    for (Index column = 0; column < 3; ++column)
      EXPECT_EQ((a * b)(row, column), multiply(a.row(row), b.col(column)));
  }
}

TEST_P(EigenTest, ProductsOfVectorsAndQuaternionsHaveTheOrderOfTheirDefinition) {
  const Vector3d a = draw<Vector3d>(), b = draw<Vector3d>();
  const Vector3d cross(a.y() * b.z() - a.z() * b.y(), a.z() * b.x() - a.x() * b.z(),
                       a.x() * b.y() - a.y() * b.x());
  EXPECT_EQ(a.cross(b), cross);
  const Quaterniond p(draw<Eigen::Vector4d>()), q(draw<Eigen::Vector4d>());
  EXPECT_EQ((p * q).coeffs(),
            Eigen::Vector4d(p.w() * q.x() + p.x() * q.w() + p.y() * q.z() - p.z() * q.y(),
                            p.w() * q.y() + p.y() * q.w() + p.z() * q.x() - p.x() * q.z(),
                            p.w() * q.z() + p.z() * q.w() + p.x() * q.y() - p.y() * q.x(),
                            p.w() * q.w() - p.x() * q.x() - p.y() * q.y() - p.z() * q.z()));
  const Vector3d twice = p.vec().cross(a) + p.vec().cross(a);
  EXPECT_EQ(p * a, a + p.w() * twice + p.vec().cross(twice));
  const double x = 2.0 * p.x(), y = 2.0 * p.y(), z = 2.0 * p.z();
  Matrix3d R;
  R << 1.0 - (y * p.y() + z * p.z()), y * p.x() - z * p.w(), z * p.x() + y * p.w(),  //
      y * p.x() + z * p.w(), 1.0 - (x * p.x() + z * p.z()), z * p.y() - x * p.w(),   //
      z * p.x() - y * p.w(), z * p.y() + x * p.w(), 1.0 - (x * p.x() + y * p.y());
  EXPECT_EQ(p.toRotationMatrix(), R);
}

/// x of A x = b: Gaussian elimination with the largest pivot of each column.
VectorXd eliminate(MatrixXd A, VectorXd b) {
  const Index n = A.rows();
  for (Index k = 0; k < n; ++k) {
    Index pivot = k;
    for (Index row = k + 1; row < n; ++row)
      if (std::abs(A(row, k)) > std::abs(A(pivot, k))) pivot = row;
    A.row(k).swap(A.row(pivot));
    std::swap(b[k], b[pivot]);
    for (Index row = k + 1; row < n; ++row) {
      A(row, k) /= A(k, k);
      for (Index column = k + 1; column < n; ++column) A(row, column) -= A(row, k) * A(k, column);
      b[row] -= A(row, k) * b[k];
    }
  }
  for (Index k = n; k-- > 0;) {
    b[k] /= A(k, k);
    for (Index row = 0; row < k; ++row) b[row] -= A(row, k) * b[k];
  }
  return b;
}

TEST_P(EigenTest, EquationsAreSolvedInTheOrderOfElimination) {
  for (const Index n : {2, 3, 4, 8}) {
    const MatrixXd A = draw<MatrixXd>(n, n);
    const VectorXd b = draw<VectorXd>(n, 1);
    EXPECT_EQ(A.partialPivLu().solve(b), eliminate(A, b)) << n;
  }
}

TEST_P(EigenTest, ThePositiveDefiniteAreSolvedByCholeskysRoots) {
  const Matrix3d half = draw<Matrix3d>();
  const Matrix3d A = half * half.transpose() + Matrix3d::Identity();
  const Vector3d b = draw<Vector3d>();
  Matrix3d L = Matrix3d::Zero();
  L(0, 0) = std::sqrt(A(0, 0));
  L(1, 0) = A(1, 0) / L(0, 0);
  L(2, 0) = A(2, 0) / L(0, 0);
  L(1, 1) = std::sqrt(A(1, 1) - L(1, 0) * L(1, 0));
  L(2, 1) = (A(2, 1) - L(2, 0) * L(1, 0)) / L(1, 1);
  L(2, 2) = std::sqrt(A(2, 2) - (L(2, 0) * L(2, 0) + L(2, 1) * L(2, 1)));
  Vector3d x;
  x[0] = b[0] / L(0, 0);
  x[1] = (b[1] - L(1, 0) * x[0]) / L(1, 1);
  x[2] = (b[2] - (L(2, 0) * x[0] + L(2, 1) * x[1])) / L(2, 2);
  x[2] /= L(2, 2);
  x[1] = (x[1] - L(2, 1) * x[2]) / L(1, 1);
  x[0] = (x[0] - (L(1, 0) * x[1] + L(2, 0) * x[2])) / L(0, 0);
  EXPECT_EQ(A.llt().solve(b), x);
}

INSTANTIATE_TEST_SUITE_P(Drawn, EigenTest, testing::Range(0U, 50U));

}  // namespace
}  // namespace sls::model
