/// Accelerations of the body and its pendulum from Simbody's mass properties and orientations.
/// Source: README.md, eqs. (7) to (12). "Integration" says why Simbody does
/// not compute them.
#pragma once

#include <Simbody.h>

#include <Eigen/Cholesky>
#include <Eigen/LU>

namespace sls::sim {

/// The load hangs on a massless rod (`kPoint`), or rod and load are a rigid body (`kRigid`). Frame
/// P is the pendulum's frame: its origin is the joint, its z axis is the rod, and its axes are the
/// principal axes of inertia.
enum class PendulumBody { kPoint, kRigid };

class MultirotorDynamics {
 public:
  /// `p_BA` is the joint in the body's frame, m; mass properties are about the frames' origins.
  MultirotorDynamics(const SimTK::MassProperties& body, const SimTK::Vec3& p_BA,
                     const SimTK::MassProperties& pendulum, PendulumBody kind, double gravity)
      : kind_(kind),
        gravity_W_(0, 0, gravity),
        mass_(body.getMass()),
        p_BC_(body.getMassCenter()),
        p_CA_B_(p_BA - p_BC_),
        inertia_B_(body.calcCentralInertia().toMat33()),
        inverse_inertia_B_(invert(inertia_B_)),
        mobility_B_(calc_mobility(mass_, p_CA_B_, inverse_inertia_B_)),
        pendulum_mass_(pendulum.getMass()),
        centre_(pendulum.getMassCenter()[2]) {
    if (kind_ == PendulumBody::kPoint) return;
    pendulum_inertia_P_ = pendulum.calcCentralInertia().toMat33();
    inverse_pendulum_inertia_P_ = invert(pendulum_inertia_P_);
    pendulum_mobility_P_ =
        calc_mobility(pendulum_mass_, SimTK::Vec3(0, 0, -centre_), inverse_pendulum_inertia_P_);
  }

  /// Orientations and angular velocities of both bodies.
  struct Rotations {
    const SimTK::Rotation& R_WB;
    SimTK::Vec3 w_WB_W;  ///< rad/s
    const SimTK::Rotation& R_WP;
    SimTK::Vec3 w_WP_W;  ///< rad/s
  };
  struct Accelerations {
    SimTK::Vec3 b_WB_W;  ///< angular, of the body, rad/s²
    SimTK::Vec3 a_WQ;    ///< of the body's origin, m/s²
    SimTK::Vec3 b_WP_W;  ///< angular, of the pendulum, rad/s²; for kPoint only across the rod
    double tension;      ///< force of the joint along the rod, N
  };

  /// A force on the load.
  struct LoadForce {
    SimTK::Vec3 force_W;  ///< N
    double distance;      ///< of the load below the joint, m
  };

  /// Accelerations under gravity, `force_W` at the body's origin (N) and `torque_W` about it (N·m).
  Accelerations calc_accelerations(const Rotations& at, const SimTK::Vec3& force_W,
                                   const SimTK::Vec3& torque_W,
                                   const LoadForce* on_load = nullptr) const {
    const SimTK::Rotation& R_WB = at.R_WB;
    const SimTK::Vec3 w_B = ~R_WB * at.w_WB_W, force_B = ~R_WB * force_W;
    // Eq. (7): the body without its pendulum.
    const SimTK::Vec3 torque_C_B = ~R_WB * torque_W - p_BC_ % force_B;
    const SimTK::Vec3 free_b_B = inverse_inertia_B_ * (torque_C_B - w_B % (inertia_B_ * w_B));
    const SimTK::Vec3 free_a_WC = gravity_W_ + force_W / mass_;
    const SimTK::Vec3 free_a_WA = free_a_WC + R_WB * (free_b_B % p_CA_B_ + w_B % (w_B % p_CA_B_));

    const Load load = calc_load(at, on_load);
    const JointForce joint = kind_ == PendulumBody::kPoint ? hold_point(at, free_a_WA, load)
                                                           : hold_rigid(at, free_a_WA, load);
    // Eq. (12).
    const SimTK::Vec3 b_B = free_b_B + inverse_inertia_B_ * (p_CA_B_ % (~R_WB * joint.on_body_W));
    const SimTK::Vec3 a_WC = free_a_WC + joint.on_body_W / mass_;
    return {R_WB * b_B, a_WC - R_WB * (b_B % p_BC_ + w_B % (w_B % p_BC_)), joint.b_WP_W,
            ~joint.on_body_W * at.R_WP.z()};
  }

 private:
  struct JointForce {
    SimTK::Vec3 on_body_W;  // N
    SimTK::Vec3 b_WP_W;     // of the pendulum with this force
  };

  /// What the load (of kRigid, the pendulum's centre) does without its joint, besides (10).
  struct Load {
    SimTK::Vec3 free_a_W;  // m/s²
    bool is_pushed;        // by a force on the load
    SimTK::Vec3 b_P;       // by that force, of kRigid, rad/s²
  };
  Load calc_load(const Rotations& at, const LoadForce* on_load) const {
    if (!on_load) return {gravity_W_, false, {}};
    const SimTK::Vec3 p_GL(0, 0, on_load->distance - centre_);
    SimTK::Vec3 b_P(0);
    if (kind_ == PendulumBody::kRigid)
      b_P = inverse_pendulum_inertia_P_ * (p_GL % (~at.R_WP * on_load->force_W));
    return {gravity_W_ + on_load->force_W / pendulum_mass_, true, b_P};
  }

  /// Eqs. (8) and (9): a point load, which can only be pulled along the rod.
  JointForce hold_point(const Rotations& at, const SimTK::Vec3& free_a_WA, const Load& load) const {
    const SimTK::Vec3 n_W = at.R_WP.z(), n_dot_W = at.w_WP_W % n_W;
    const SimTK::Vec3 moved_W = at.R_WB * (mobility_B_ * (~at.R_WB * n_W));  // m/s² per N
    const double tension = (~n_W * (load.free_a_W - free_a_WA) + centre_ * n_dot_W.normSqr()) /
                           (1.0 / pendulum_mass_ + ~n_W * moved_W);
    const SimTK::Vec3 a_WL = load.free_a_W - tension / pendulum_mass_ * n_W;
    const SimTK::Vec3 n_ddot_W = (a_WL - free_a_WA - tension * moved_W) / centre_;
    return {tension * n_W, n_W % n_ddot_W - (~at.w_WP_W * n_W) * (n_W % at.w_WP_W)};
  }

  /// Eqs. (10) and (11): rod and load as one body. Computed in P.
  [[gnu::flatten]] JointForce hold_rigid(const Rotations& at, const SimTK::Vec3& free_a_WA,
                                         const Load& load) const {
    const SimTK::Rotation R_PB = ~at.R_WP * at.R_WB;
    const SimTK::Vec3 w_P = ~at.R_WP * at.w_WP_W;
    const SimTK::Vec3 p_GA(0, 0, -centre_);  // from the centre of mass to the joint
    SimTK::Vec3 free_b_P = inverse_pendulum_inertia_P_ * -(w_P % (pendulum_inertia_P_ * w_P));
    if (load.is_pushed) free_b_P += load.b_P;
    const SimTK::Vec3 free_a_P = ~at.R_WP * load.free_a_W + free_b_P % p_GA + w_P % (w_P % p_GA);
    const SimTK::Mat33 mobility = R_PB * mobility_B_ * ~R_PB + pendulum_mobility_P_;
    const SimTK::Vec3 on_body_P = solve(mobility, free_a_P - ~at.R_WP * free_a_WA);
    const SimTK::Vec3 b_P = free_b_P - inverse_pendulum_inertia_P_ * (p_GA % on_body_P);
    return {at.R_WP * on_body_P, at.R_WP * b_P};
  }

  /// Acceleration of the point at `p` from a body's centre of mass, per force on that point.
  static SimTK::Mat33 calc_mobility(double mass, const SimTK::Vec3& p,
                                    const SimTK::Mat33& inverse_inertia) {
    Eigen::Matrix3d cross;
    cross << 0.0, -p[2], p[1], p[2], 0.0, -p[0], -p[1], p[0], 0.0;
    return to_simtk(Eigen::Matrix3d::Identity() / mass - cross * to_eigen(inverse_inertia) * cross);
  }

  /// Both store columns, without gaps.
  static Eigen::Matrix3d to_eigen(const SimTK::Mat33& m) {
    return Eigen::Map<const Eigen::Matrix3d>(&m(0, 0));
  }
  static SimTK::Mat33 to_simtk(const Eigen::Matrix3d& m) {
    return {m(0, 0), m(0, 1), m(0, 2), m(1, 0), m(1, 1), m(1, 2), m(2, 0), m(2, 1), m(2, 2)};
  }
  static SimTK::Mat33 invert(const SimTK::Mat33& m) { return to_simtk(to_eigen(m).inverse()); }
  /// x of m x = y; m is symmetric and positive definite.
  static SimTK::Vec3 solve(const SimTK::Mat33& m, const SimTK::Vec3& y) {
    const Eigen::Vector3d x = to_eigen(m).llt().solve(Eigen::Vector3d(y[0], y[1], y[2]));
    return {x[0], x[1], x[2]};
  }

  const PendulumBody kind_;
  const SimTK::Vec3 gravity_W_;  // m/s²
  const double mass_;            // of the body, kg
  const SimTK::Vec3 p_BC_;       // its centre of mass C from its origin, m
  const SimTK::Vec3 p_CA_B_;     // the joint from C, m
  const SimTK::Mat33 inertia_B_, inverse_inertia_B_;
  const SimTK::Mat33 mobility_B_;  // K of eq. (8), 1/kg
  const double pendulum_mass_;     // kg
  const double centre_;            // of the pendulum's mass below the joint, m
  SimTK::Mat33 pendulum_inertia_P_, inverse_pendulum_inertia_P_;
  SimTK::Mat33 pendulum_mobility_P_;  // K′ of eq. (10), 1/kg
};

}  // namespace sls::sim
