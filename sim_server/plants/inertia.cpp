#include "sim_server/plants/inertia.hpp"

#include <Eigen/Eigenvalues>
#include <sstream>

#include "common/config/numbers.hpp"

namespace sls::sim {

using Eigen::Matrix3d, Eigen::Vector3d;

Matrix3d make_inertia(const Vector3d& moments, const Vector3d& products) {
  Matrix3d tensor = moments.asDiagonal();
  tensor(0, 1) = tensor(1, 0) = products[0];
  tensor(0, 2) = tensor(2, 0) = products[1];
  tensor(1, 2) = tensor(2, 1) = products[2];
  return tensor;
}

Vector3d calc_principal_moments(const Matrix3d& inertia) {
  return Eigen::SelfAdjointEigenSolver<Matrix3d>(inertia).eigenvalues();
}

std::string find_inertia_defect(const Matrix3d& inertia) {
  const Vector3d principal = calc_principal_moments(inertia);
  std::ostringstream list;
  list.precision(12);  // further digits are errors of the solver
  list << principal[0] << ", " << principal[1] << ", " << principal[2];
  const double rounding = 1e-12 * principal[2];
  if (principal[0] < -rounding) return "expected principal moments >= 0, got " + list.str();
  if (principal[2] > principal[0] + principal[1] + rounding)
    return "expected principal moments of which none is larger than the sum of the others, got " +
           list.str();
  return "";
}

std::string find_free_inertia_defect(const Matrix3d& inertia) {
  const std::string defect = find_inertia_defect(inertia);
  const Vector3d principal = calc_principal_moments(inertia);
  if (!defect.empty() || principal[0] > 1e-12 * principal[2]) return defect;
  return "expected principal moments > 0, got " + config::to_text(principal[0]);
}

}  // namespace sls::sim
