#include "sim_server/autopilots/geometric/attitude_tracking.hpp"

#include <Eigen/Geometry>

#include "common/model/rotation.hpp"

namespace sls::sim::geometric {

using Eigen::Matrix3d, Eigen::Vector3d;

Gains make_default_gains(const Matrix3d& inertia_C_B) {
  constexpr double kFrequency = 10.0;  // rad/s
  constexpr double kDamping = 1.0;
  const double inertia = inertia_C_B.trace() / 3.0;
  return {inertia * kFrequency * kFrequency, 2.0 * kDamping * inertia * kFrequency};
}

double calc_attitude_distance(const Matrix3d& R_WB, const Matrix3d& R_WB_wanted) {
  return 0.5 * (3.0 - (R_WB_wanted.transpose() * R_WB).trace());
}

Vector3d calc_attitude_error(const Matrix3d& R_WB, const Matrix3d& R_WB_wanted) {
  return model::calc_antisymmetric_vector(R_WB_wanted.transpose() * R_WB);
}

Vector3d calc_rate_error(const Rotation& rotation, const WantedRotation& wanted) {
  return rotation.w_WB_B - rotation.R_WB.transpose() * wanted.R_WB * wanted.w_WB_B;
}

Vector3d calc_moment(const Rotation& rotation, const WantedRotation& wanted,
                     const Matrix3d& inertia_C_B, const Gains& gains) {
  const Vector3d& w = rotation.w_WB_B;
  const Matrix3d to_body = rotation.R_WB.transpose() * wanted.R_WB;
  const Vector3d e_R = calc_attitude_error(rotation.R_WB, wanted.R_WB);
  const Vector3d e_w = calc_rate_error(rotation, wanted);
  return -gains.attitude * e_R - gains.rate * e_w + w.cross(inertia_C_B * w) -
         inertia_C_B * (w.cross(to_body * wanted.w_WB_B) - to_body * wanted.w_dot_WB_B);
}

}  // namespace sls::sim::geometric
