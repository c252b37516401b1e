/// An autopilot turns the force that a controller commands into set-points of the rotor speeds. To
/// add one: a folder beside this file and a line in autopilots.def; README.md, "Adding an
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

/// The autopilot's model of a rotor. At the speed ω its thrust is T = `thrust_constant` ω² along
/// `axis_B`. The torque of its drag on the body is −`spin` × `torque_constant` × T about `axis_B`.
struct Rotor {
  Eigen::Vector3d p_BR = Eigen::Vector3d::Zero();      ///< hub, from the body's origin, in B, m
  Eigen::Vector3d axis_B = -Eigen::Vector3d::UnitZ();  ///< unit vector along the thrust
  double spin = 1.0;  ///< +1 counter-clockwise seen against the thrust (from above), −1
  double thrust_constant = 0.0;  ///< N·s²
  double torque_constant = 0.0;  ///< m
  double min_speed = 0.0;        ///< rad/s
  double max_speed = 0.0;        ///< rad/s
};

/// The rigid body of the vehicle with everything fixed to it, without the pendulum.
struct Airframe {
  double mass = 0.0;                                      ///< kg
  Eigen::Vector3d p_BC = Eigen::Vector3d::Zero();         ///< centre of mass C from the origin, m
  Eigen::Matrix3d inertia_C_B = Eigen::Matrix3d::Zero();  ///< about C, in B, kg·m²
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

/// Input of an autopilot's step. W is the world frame of the autopilot's estimator. It differs from
/// the plant's if the scenario sets `estimator.tilt_rad` or `yaw_rad`.
struct AutopilotInput {
  Eigen::Vector3d f_Q_W;  ///< commanded force, N
  Eigen::Vector3d v_WQ;   ///< of the body's origin, m/s
  model::Attitude attitude;
};

/// Output of an autopilot, valid until its next step.
struct AutopilotOutput {
  Eigen::VectorXd rotor_speeds;  ///< set-points, rad/s; the plant clamps each to its rotor's limits
  Eigen::Quaterniond q_WB = Eigen::Quaterniond::Identity();  ///< attitude set-point, for the record
  double thrust = 0.0;  ///< commanded collective thrust along the rotors' axes, N
  /// Set by an autopilot that turns the thrust instead of the vehicle. All thrust then acts in this
  /// direction (unit vector, in W) at the centre of mass, and no rotor turns the body.
  std::optional<Eigen::Vector3d> direction_W;
};

/// A pure function of its setup and the sequence of its steps.
class Autopilot {
 public:
  virtual ~Autopilot() = default;
  /// One period. The output stays valid until the next step.
  /// @throws std::runtime_error if it cannot continue; the text names the quantity.
  virtual const AutopilotOutput& step(const AutopilotInput& input) = 0;
};

/// The autopilot that `setup.autopilot.model` names.
/// @throws config::ConfigError if the setup contradicts the autopilot, or a library cannot be used.
std::unique_ptr<Autopilot> make_autopilot(const AutopilotSetup& setup);

/// Attitude with the heading `yaw` whose −z axis points along `f_W`. `f_W` must not be zero.
/// Source: common/model/README.md, eq. (8), turned about z by the yaw.
Eigen::Quaterniond calc_attitude_for(const Eigen::Vector3d& f_W, double yaw = 0.0);

/// Speeds at which each rotor gives the same share of `thrust` (N). Rotors that are alike then make
/// no moment together. Without limits and losses.
Eigen::VectorXd calc_equal_speeds(const std::vector<Rotor>& rotors, double thrust);

}  // namespace sls::sim
