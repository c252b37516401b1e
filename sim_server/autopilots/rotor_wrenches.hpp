/// Wrenches of all rotors of an airframe, for autopilots that allocate torque and thrust to them.
#pragma once

#include <Eigen/Core>

#include "sim_server/autopilots/autopilot.hpp"

namespace sls::sim {

/// Column i: torque about the centre of mass (3×1, m) and force (3×1), in B, per newton of thrust
/// of rotor i.
Eigen::Matrix<double, 6, Eigen::Dynamic> calc_rotor_wrenches(const Airframe& airframe);

/// Moore–Penrose inverse. Singular values below 1e-9 of the largest count as zero.
Eigen::MatrixXd calc_pseudo_inverse(const Eigen::MatrixXd& matrix);

/// True if the rotors can turn the body about z without changing roll, pitch and thrust.
bool has_yaw_authority(const Airframe& airframe);

/// The result of `has_yaw_authority`, for an autopilot that needs roll and pitch.
/// @throws config::ConfigError if the rotors cannot roll or pitch the body without changing the
/// thrust; `setup` gives the place in the scenario.
bool find_yaw_authority(const AutopilotSetup& setup);

/// The error at the key `key` of the scenario that `setup` comes from.
config::ConfigError make_setup_error(const AutopilotSetup& setup, const std::string& key,
                                     const std::string& message);

}  // namespace sls::sim
