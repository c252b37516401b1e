/// The attitude part of geometric tracking control on SE(3).
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace sls::sim::geometric {

struct Gains {
  double attitude = 0.0;  ///< k_R, N·m
  double rate = 0.0;      ///< k_Ω, N·m·s
};

/// README.md, eq. (6): from the mean moment of inertia of `inertia_C_B` (kg·m²).
Gains make_default_gains(const Eigen::Matrix3d& inertia_C_B);

/// Rotation of B in W, R_WB, and its rate, each in the body's own axes.
struct Rotation {
  Eigen::Matrix3d R_WB = Eigen::Matrix3d::Identity();
  Eigen::Vector3d w_WB_B = Eigen::Vector3d::Zero();  ///< rad/s
};
/// Set-point of the rotation, with the derivative of its rate.
struct WantedRotation : Rotation {
  Eigen::Vector3d w_dot_WB_B = Eigen::Vector3d::Zero();  ///< rad/s²
};

/// Ψ, 0 … 2: 1 − cos of the angle between the two attitudes. README.md, eq. (2).
double calc_attitude_distance(const Eigen::Matrix3d& R_WB, const Eigen::Matrix3d& R_WB_wanted);

/// e_R (3×1). README.md, eq. (3).
Eigen::Vector3d calc_attitude_error(const Eigen::Matrix3d& R_WB,
                                    const Eigen::Matrix3d& R_WB_wanted);

/// e_Ω (3×1, rad/s). README.md, eq. (4).
Eigen::Vector3d calc_rate_error(const Rotation& rotation, const WantedRotation& wanted);

/// Moment about the centre of mass in B, N·m. README.md, eq. (5).
Eigen::Vector3d calc_moment(const Rotation& rotation, const WantedRotation& wanted,
                            const Eigen::Matrix3d& inertia_C_B, const Gains& gains);

}  // namespace sls::sim::geometric
