/// The scalar product with the same bits for every version of Eigen.
#pragma once

#include <Eigen/Core>

namespace sls::model {

/// aᵀ b of vectors of the same shape. The products are added in halves, (0) + (1 + 2) of three, as
/// `sum()` does in Eigen 3.4 and 5. `a.dot(b)` adds from left to right since Eigen 5, so no code
/// that a recording depends on may use it.
template <class A, class B>
double dot(const Eigen::MatrixBase<A>& a, const Eigen::MatrixBase<B>& b) {
  return a.cwiseProduct(b).sum();
}

}  // namespace sls::model
