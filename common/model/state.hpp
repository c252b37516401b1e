/// The state of a slung load, and the maps between rod angles and positions. Source: README.md.
#pragma once

#include <Eigen/Core>

#include "common/model/parameters.hpp"

namespace sls::model {

/// Rod attitude: α about x, β about y, and their true angular rates. Hanging at rest: all zero.
struct RodAngles {
  double alpha = 0.0;      ///< rad, in (−π, π]
  double beta = 0.0;       ///< rad, in [−π/2, π/2]
  double alpha_dot = 0.0;  ///< rad/s
  double beta_dot = 0.0;   ///< rad/s
};

/// The same attitude as a direction: unit vector from quadrotor to load and its derivative.
struct RodDirection {
  Eigen::Vector3d n_W = Eigen::Vector3d::UnitZ();     ///< |n_W| = 1
  Eigen::Vector3d n_dot_W = Eigen::Vector3d::Zero();  ///< 1/s, n_W · n_dot_W = 0
};

/// The motion of both bodies, as a state sample carries it.
struct SlungLoadState {
  Eigen::Vector3d p_WQ = Eigen::Vector3d::Zero();  ///< quadrotor position, m
  Eigen::Vector3d v_WQ = Eigen::Vector3d::Zero();  ///< quadrotor velocity, m/s
  Eigen::Vector3d p_WL = Eigen::Vector3d::Zero();  ///< load position, m
  Eigen::Vector3d v_WL = Eigen::Vector3d::Zero();  ///< load velocity, m/s
  RodAngles rod;
};

/// Direction of the rod for the given angles. Source: README.md, eqs. (1) and (2).
RodDirection to_direction(const RodAngles& angles);

/// Angles of the given direction, the inverse of `to_direction` for |β| < π/2.
/// At |β| = π/2 the angle α is not defined: alpha is then 0 and alpha_dot not finite or arbitrary.
/// Source: README.md, eqs. (3) and (4).
RodAngles to_angles(const RodDirection& direction);

/// State of a slung load whose quadrotor is at `p_WQ` with velocity `v_WQ`.
SlungLoadState make_state(const Eigen::Vector3d& p_WQ, const Eigen::Vector3d& v_WQ,
                          const RodAngles& rod, double rod_length);

/// The same from the positions and velocities of both bodies; the distance is the rod's length.
SlungLoadState make_state(const Eigen::Vector3d& p_WQ, const Eigen::Vector3d& v_WQ,
                          const Eigen::Vector3d& p_WL, const Eigen::Vector3d& v_WL);

/// True when every number of `state` is finite.
bool is_finite(const SlungLoadState& state);

}  // namespace sls::model
