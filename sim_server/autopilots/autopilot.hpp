/// An autopilot: it turns the force that a controller commands into what the rotors are to
/// do. A new one is a folder beside this file and a line in autopilots.def: README.md, "Adding an
/// autopilot". No DDS and no Simbody here.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <vector>

#include "common/config/model_keys.hpp"
#include "common/config/scenario.hpp"
#include "common/model/measurement.hpp"

namespace sls::sim {

/// A rotor as the autopilot knows it, turning at ω. Its thrust is T = `thrust_constant` ω² along
/// `axis_B`, the torque of its drag on the body −`spin` × `torque_constant` × T about `axis_B`.
struct Rotor {
  Eigen::Vector3d p_BR = Eigen::Vector3d::Zero();      ///< hub, from the body's origin, in B, m
  Eigen::Vector3d axis_B = -Eigen::Vector3d::UnitZ();  ///< unit vector along the thrust
  double spin = 1.0;  ///< +1 counter-clockwise seen against the thrust (from above), −1
  double thrust_constant = 0.0;  ///< N·s²
  double torque_constant = 0.0;  ///< m
  double min_speed = 0.0;        ///< rad/s
  double max_speed = 0.0;        ///< rad/s
};

/// The rigid body that is flown, with all that is fixed to it; without the pendulum.
struct Airframe {
  double mass = 0.0;                                      ///< kg
  Eigen::Vector3d p_BC = Eigen::Vector3d::Zero();         ///< centre of mass from the origin, m
  Eigen::Matrix3d inertia_C_B = Eigen::Matrix3d::Zero();  ///< about it, in B, kg·m²
  std::vector<Rotor> rotors;                              ///< at least one
};

/// The inputs from which an autopilot is made.
struct AutopilotSetup {
  config::Autopilot autopilot;   ///< its period is at least a step
  std::filesystem::path folder;  ///< of the scenario file
  std::uint32_t vehicle_id = 0;
  model::SlungLoadParameters vehicle;  ///< masses, rod length, gravity
  Airframe airframe;
};

/// Input of an autopilot's step. Its world W is the one of its estimator: that
/// differs from the plant's where the scenario says `estimator.tilt_rad` or `yaw_rad`.
struct AutopilotInput {
  Eigen::Vector3d f_Q_W;  ///< the force that is asked for, N
  Eigen::Vector3d v_WQ;   ///< of the body's origin, m/s
  model::Attitude attitude;
};

/// Its output until its next step.
struct AutopilotOutput {
  Eigen::VectorXd rotor_speeds;  ///< set-points, rad/s; the plant keeps each to its rotor's limits
  Eigen::Quaterniond q_WB = Eigen::Quaterniond::Identity();  ///< attitude set-point, for the record
  double thrust = 0.0;  ///< collective thrust that is asked for along the rotors' axes, N
  /// Set by an autopilot that turns the thrust and not the vehicle: all thrust then acts in this
  /// direction (unit vector, in W) at the centre of mass, and no rotor turns the body.
  std::optional<Eigen::Vector3d> direction_W;
};

/// A pure function of its setup and the sequence of its steps.
class Autopilot {
 public:
  virtual ~Autopilot() = default;
  /// One period. The output stays valid until the next step.
  /// @throws std::runtime_error if it cannot go on; the text names the quantity.
  virtual const AutopilotOutput& step(const AutopilotInput& input) = 0;
};

/// The autopilot that `setup.autopilot.model` names.
/// @throws config::ConfigError if the setup contradicts it, or a library cannot be used.
std::unique_ptr<Autopilot> make_autopilot(const AutopilotSetup& setup);

/// Attitude whose −z axis points along `f_W`, which is not zero, with the heading `yaw`:
/// design, section 4, "commanded attitude", turned about z by the yaw.
Eigen::Quaterniond calc_attitude_for(const Eigen::Vector3d& f_W, double yaw = 0.0);

/// Speeds at which the rotors give the thrust `thrust` (N) together without moment where they are
/// alike: each the same share of it. No limits, no losses.
Eigen::VectorXd calc_equal_speeds(const std::vector<Rotor>& rotors, double thrust);

}  // namespace sls::sim
