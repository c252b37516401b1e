/// From torques and thrust to the outputs of the rotors.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "sim_server/autopilots/autopilot.hpp"
#include "sim_server/autopilots/px4/rate_control.hpp"

namespace sls::sim::px4 {

/// Share of each normalised demand in a rotor's output.
struct MixerRow {
  double roll = 0.0;
  double pitch = 0.0;
  double yaw = 0.0;
  double thrust = 1.0;
};

/// Rows for the positions, axes and constants of the rotors, scaled as in PX4: README.md, eq. (12).
/// If the rotors have no authority over yaw, the yaw entries are 0.
/// @throws config::ConfigError if the rotors cannot roll or pitch the body.
std::vector<MixerRow> make_mixer(const AutopilotSetup& setup);

struct MixerOutput {
  Eigen::VectorXd outputs;  ///< of each rotor, 0 … 1
  Saturation saturation;
};

/// README.md, "Mixer". `torque` (roll, pitch, yaw) is clamped to ±1, `thrust` to 0 … 1.
MixerOutput mix(const std::vector<MixerRow>& mixer, const Eigen::Vector3d& torque, double thrust);

}  // namespace sls::sim::px4
