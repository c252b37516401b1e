/// Inertia tensors that scenarios and Python describe, and what is wrong with them.
#pragma once

#include <Eigen/Core>
#include <string>

namespace sls::sim {

/// `moments` xx, yy, zz and `products` xy, xz, yz, as they stand in the tensor, kg·m².
Eigen::Matrix3d make_inertia(const Eigen::Vector3d& moments, const Eigen::Vector3d& products);

/// The principal moments of an inertia tensor, ascending.
Eigen::Vector3d calc_principal_moments(const Eigen::Matrix3d& inertia);

/// Triangle rule of a rigid body: no principal moment is larger than the sum of the others.
/// Returns the defect, or an empty text.
std::string find_inertia_defect(const Eigen::Matrix3d& inertia);

/// The same of a body that turns freely, so that no principal moment may be 0 either.
std::string find_free_inertia_defect(const Eigen::Matrix3d& inertia);

}  // namespace sls::sim
