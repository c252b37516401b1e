#include "control_client/laws/cooperative/distribution.hpp"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>

#include "common/model/math.hpp"

namespace sls::control {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

Vector3d calc_middle(const model::SharedLoad& load) {
  Vector3d sum(0.0, 0.0, 0.0);
  for (const auto& cable : load.cables) sum += cable.attachment_L;
  return sum / static_cast<double>(load.cables.size());
}

std::vector<Vector3d> list_arms(const model::SharedLoad& load) {
  const Vector3d middle = calc_middle(load);
  std::vector<Vector3d> arms;
  for (const auto& cable : load.cables) arms.push_back(cable.attachment_L - middle);
  return arms;
}

/// S of eq. (6): the inertia of unit masses at the arms.
Matrix3d calc_spread_matrix(const std::vector<Vector3d>& arms) {
  Matrix3d S = Matrix3d::Zero();
  for (const Vector3d& arm : arms)
    S += arm.squaredNorm() * Matrix3d::Identity() - arm * arm.transpose();
  return S;
}

}  // namespace

bool can_turn(const model::SharedLoad& load) {
  constexpr double kThinnest = 1e-6;  // of the squared extents across and along the line
  const Matrix3d S = calc_spread_matrix(list_arms(load));
  const double extent = 0.5 * S.trace();
  return S.determinant() > kThinnest * extent * extent * extent;
}

Distribution::Distribution(const model::SharedLoad& load)
    : is_rigid_(load.inertia_L.has_value()),
      middle_L_(calc_middle(load)),
      arms_L_(list_arms(load)) {
  if (is_rigid_) inverse_ = calc_spread_matrix(arms_L_).inverse();
}

Vector3d Distribution::calc_share(std::size_t cable, const Vector3d& force_L,
                                  const Vector3d& moment_L) const {
  const Vector3d even = force_L / static_cast<double>(arms_L_.size());
  if (!is_rigid_) return even;
  const Vector3d turn = inverse_ * (moment_L - middle_L_.cross(force_L));
  return even + turn.cross(arms_L_[cable]);
}

std::vector<Vector3d> Distribution::calc_internal(double outwards) const {
  const std::size_t count = arms_L_.size();
  std::vector<Vector3d> forces;
  if (!is_rigid_) {  // eq. (8)
    constexpr double kTwoPi = 6.283185307179586476925286766559;
    for (std::size_t i = 0; i < count; ++i) {
      const math::SineCosine at =
          math::sincos(kTwoPi * static_cast<double>(i) / static_cast<double>(count));
      forces.emplace_back(outwards * at.cosine, outwards * at.sine, 0.0);
    }
    if (count == 1) forces[0].setZero();
    return forces;
  }
  double widest = 0.0;
  for (const Vector3d& arm : arms_L_) widest = std::max(widest, math::hypot(arm.x(), arm.y()));
  Vector3d moment(0.0, 0.0, 0.0);
  for (const Vector3d& arm : arms_L_) {
    forces.emplace_back(outwards / widest * arm.x(), outwards / widest * arm.y(), 0.0);
    moment += arm.cross(forces.back());
  }
  // Eq. (7): without the moment, which attachments at different heights leave.
  const Vector3d turn = inverse_ * moment;
  for (std::size_t i = 0; i < count; ++i) forces[i] -= turn.cross(arms_L_[i]);
  return forces;
}

}  // namespace sls::control
