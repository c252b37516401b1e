/// Accelerations of a quadrotor, a point mass, and its pendulum from Simbody's mass properties and
/// position kinematics. Source: README.md, eqs. (2) and (3). "Integration" says why Simbody
/// does not compute them.
#pragma once

#include <Simbody.h>

namespace sls::sim {

/// Frame L is the pendulum's frame: its origin is the joint at the quadrotor, its z axis is the
/// rod, and its axes are the principal axes of inertia. C is the centre of mass of both bodies.
class PendulumDynamics {
 public:
  PendulumDynamics(const SimTK::MassProperties& quadrotor, const SimTK::MassProperties& pendulum,
                   double gravity)
      : gravity_W_(0, 0, gravity), mass_(quadrotor.getMass() + pendulum.getMass()) {
    const SimTK::Vec3& centre = pendulum.getMassCenter();
    p_QC_L_ = pendulum.getMass() / mass_ * centre;
    // Inertia of the pendulum about its own centre, plus that of both masses, `centre` apart.
    const double reduced_mass = quadrotor.getMass() * pendulum.getMass() / mass_;
    inertia_C_ = (pendulum.calcCentralInertia() + SimTK::Inertia::pointMassAt(centre, reduced_mass))
                     .getMoments();
    // A point load has no inertia about the rod, and its joint has no such speed: ω̇_z = 0.
    for (int i = 0; i < 3; ++i)
      inverse_inertia_C_[i] = inertia_C_[i] > 0.0 ? 1.0 / inertia_C_[i] : 0.0;
  }

  struct Accelerations {
    SimTK::Vec3 a_WQ;  ///< of the quadrotor, m/s²
    SimTK::Vec3 b_L;   ///< angular, of the pendulum in W, axes of L, rad/s²
  };

  /// Accelerations under gravity and the force `force_W` on the quadrotor (N). `w_L` is the
  /// pendulum's angular velocity in W, axes of L, rad/s.
  Accelerations calc_accelerations(const SimTK::Rotation& R_WL, const SimTK::Vec3& w_L,
                                   const SimTK::Vec3& force_W) const {
    return move(R_WL, w_L, force_W, (~R_WL * force_W) % p_QC_L_);
  }
  /// The same with a force `on_load_W` (N) at the place `p_QL_L` of the pendulum, m.
  Accelerations calc_accelerations(const SimTK::Rotation& R_WL, const SimTK::Vec3& w_L,
                                   const SimTK::Vec3& force_W, const SimTK::Vec3& on_load_W,
                                   const SimTK::Vec3& p_QL_L) const {
    return move(R_WL, w_L, force_W + on_load_W,
                (~R_WL * force_W) % p_QC_L_ + (p_QL_L - p_QC_L_) % (~R_WL * on_load_W));
  }

 private:
  /// `moment_L` is that of all forces about C.
  Accelerations move(const SimTK::Rotation& R_WL, const SimTK::Vec3& w_L,
                     const SimTK::Vec3& force_W, const SimTK::Vec3& moment_L) const {
    const SimTK::Vec3 torque_L = moment_L - w_L % inertia_C_.elementwiseMultiply(w_L);
    const SimTK::Vec3 b_L = inverse_inertia_C_.elementwiseMultiply(torque_L);
    const SimTK::Vec3 a_QC_L = b_L % p_QC_L_ + w_L % (w_L % p_QC_L_);
    return {gravity_W_ + force_W / mass_ - R_WL * a_QC_L, b_L};
  }

  const SimTK::Vec3 gravity_W_;    // m/s²
  const double mass_;              // of both, kg
  SimTK::Vec3 p_QC_L_;             // a of eq. (3), m
  SimTK::Vec3 inertia_C_;          // J of eq. (2), principal moments, kg·m²
  SimTK::Vec3 inverse_inertia_C_;  // 1/(kg·m²)
};

}  // namespace sls::sim
