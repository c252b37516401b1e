/// The mechanics of vehicles, cables and load at one instant: geometry, accelerations, impacts.
/// README.md, eqs. (1) to (8). No DDS, no scenario.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <optional>

#include "common/model/parameters.hpp"
#include "sim_server/plants/cables/complementarity.hpp"
#include "sim_server/plants/multirotor/rotor_speed.hpp"

namespace sls::sim::cables {

using Vectors = std::array<Eigen::Vector3d, kMaxCables>;

/// The constants of a group. Cable i leads from vehicle i to a point of the load.
struct System {
  std::size_t count = 0;                ///< vehicles, 1 to kMaxCables
  Vector vehicle_mass{};                ///< kg, > 0
  bool has_attitude = false;            ///< vehicles are rigid bodies; false: points
  Eigen::Matrix3d vehicle_inertia_B{};  ///< of each rigid body, kg·m²
  Eigen::Matrix3d inverse_vehicle_inertia_B{};
  Vectors attachment_L{};       ///< in the load, from its centre of mass, m
  double load_mass = 0.2;       ///< kg, > 0
  bool is_rigid = false;        ///< false: a point load, whose attitude stays
  Eigen::Matrix3d inertia_L{};  ///< of a rigid load, kg·m²
  Eigen::Matrix3d inverse_inertia_L{};
  double gravity = 9.8;              ///< m/s², along +z
  double restitution = 0.0;          ///< of a cable that arrives at its length, 0 to 1
  Vector stiffness{};                ///< of each cable that stretches, N/m; 0: it does not
  Vector damping{};                  ///< of those, N·s/m
  std::optional<double> ground_z_W;  ///< bodies stand on it with their centre, m; none: no ground
};

struct Vehicle {
  Eigen::Vector3d p_W, v_W;
  double length, length_rate;  ///< of its cable, m and m/s
};

/// How a rigid body is turned and turns.
struct Turn {
  Eigen::Vector4d q_WB;    ///< w, x, y, z; rotates vectors from the body into W
  Eigen::Vector3d w_WB_B;  ///< in the body, rad/s
};

/// Where everything is and how it moves; as a rate, the derivative of each number.
struct Motion {
  Eigen::Vector3d p_WL, v_WL;
  Eigen::Vector4d q_WL;    ///< w, x, y, z; rotates vectors from the load into W
  Eigen::Vector3d w_WL_L;  ///< angular velocity of the load in the load, rad/s
  std::array<Vehicle, kMaxCables> vehicles;
  std::array<Turn, kMaxCables> turns;  ///< of the vehicles, if they have an attitude
};

struct Actions;

/// The rotors of all vehicles within a step, in which their set-points are held.
class Propulsion {
 public:
  virtual ~Propulsion() = default;
  /// From `start` on over `h` seconds: the speeds with which a Runge-Kutta step computes in its
  /// middle and at its end, and those that then are.
  virtual void turn(const RotorSpeeds& start, double h, RotorSpeeds& middle, RotorSpeeds& end,
                    RotorSpeeds& after) const = 0;
  /// Writes the forces and the torques of rotors with these speeds: eq. (15).
  virtual void push(const Motion& motion, const RotorSpeeds& speeds, Actions& actions) const = 0;
};

/// Forces and rates from outside, held over a step.
struct Actions {
  Vectors f_Q_W{};     ///< control force on each vehicle, N
  Vectors torque_B{};  ///< on each rigid body, about its centre of mass, N·m
  /// If it is there, HybridMotion takes force and torque from it, at every instant.
  const Propulsion* propulsion = nullptr;
  model::Aerodynamics air;
  const Vectors* v_wind_W = nullptr;  ///< at each vehicle, m/s; none: that of `air`
  model::LoadDrag load_drag;
  Eigen::Vector3d load_wind_W = Eigen::Vector3d::Zero();    ///< at the load, m/s
  Eigen::Vector3d disturbance_W = Eigen::Vector3d::Zero();  ///< on each vehicle, N
  Vector length_acceleration{};                             ///< of each cable, m/s²
};

/// The cables at one instant; README.md, eqs. (2) to (4).
struct Geometry {
  Eigen::Matrix3d R_WL;  ///< of a rigid load
  Vectors n_W;           ///< from the vehicle to its attachment, unit vector
  Vectors moment_L;      ///< ρ × Rᵀ n, m
  Vectors turn_L;        ///< J⁻¹ of it
  Vector stretch;        ///< distance less length, m; 0 if taut
  Vector stretch_rate;   ///< its derivative, m/s
  Vector bend;           ///< |d² of the distance / dt²| by the motion across the cable, m/s²
};

/// `system` with the bodies `standing` infinitely heavy: nothing accelerates or turns them.
System hold_still(const System& system, const Members& standing);

/// R of the unit quaternion along `q` (w, x, y, z).
Eigen::Matrix3d calc_rotation(const Eigen::Vector4d& q);

/// sum = start + h rate, for the vehicles of `system`.
void add(const System& system, const Motion& start, double h, const Motion& rate, Motion& sum);

/// The geometry of the `cables`. A vehicle at its attachment has n = 0.
void calc_geometry(const System& system, const Motion& motion, const Members& cables,
                   Geometry& geometry);

/// A of eq. (5), for the `cables`.
void calc_matrix(const System& system, const Geometry& geometry, const Members& cables,
                 Matrix& matrix);

/// Force on a vehicle besides gravity and its cable, N.
Eigen::Vector3d calc_force(const Actions& actions, const Vehicle& vehicle, std::size_t i);

/// Accelerations without a pull: of the load, its rates, and each vehicle. And b of eq. (5), for
/// the `cables`.
void calc_free_rate(const System& system, const Motion& motion, const Actions& actions,
                    Motion& rate);
void calc_offset(const System& system, const Motion& motion, const Geometry& geometry,
                 const Actions& actions, const Motion& free_rate, const Members& cables,
                 Vector& offset);

/// The derivative of the kinetic energy of load and vehicles (these as points), W.
double calc_power(const System& system, const Motion& motion, const Motion& rate);

/// How that energy changes from one motion to another, and the work of forces that are held and of
/// gravity on the way, J.
double calc_kinetic_change(const System& system, const Motion& from, const Motion& to);
double calc_held_work(const System& system, const Actions& actions, const Motion& from,
                      const Motion& to);

/// Adds to the accelerations `rate` those by the pulls of the `cables`, N: eq. (1). With impulses
/// (N·s) and a motion it changes the velocities.
void add_pulls(const System& system, const Geometry& geometry, const Vector& pulls,
               const Members& cables, Motion& rate);

/// Moves and turns the bodies as impulses would do it in a unit of time: eq. (8).
void add_shifts(const System& system, const Geometry& geometry, const Vector& shifts,
                const Members& cables, Motion& motion);

/// The accelerations of an instant, and the cables that cause them.
struct Accelerations {
  Motion rate;
  Vector tension;  ///< N, ≥ 0
  Members taut;
};

/// Those of the `cables` that may pull: not shorter than `tolerance` below their length (m), and
/// their ends do not approach by more than `rate_tolerance` (m/s).
Members find_candidates(const Members& cables, const Geometry& geometry, double tolerance,
                        double rate_tolerance);

/// Adds to the accelerations `rate` those by the cables `stretched`, and writes their tensions:
/// eq. (19).
void add_springs(const System& system, const Geometry& geometry, const Members& stretched,
                 Vector& tension, Motion& rate);

/// The accelerations of `motion` with the cables `stretched`, where of the `candidates` those pull
/// that have to; eq. (5).
Accelerations calc_accelerations(const System& system, const Motion& motion,
                                 const Geometry& geometry, const Actions& actions,
                                 const Members& candidates, const Members& stretched = {});

/// Changes the velocities of `motion` so that no cable of `candidates`, all at their length,
/// lengthens; eqs. (6) and (7). Returns the impulses of all cables, N·s.
Vector apply_impact(const System& system, double restitution, const Members& candidates,
                    Motion& motion);

}  // namespace sls::sim::cables
