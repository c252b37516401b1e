// The hand-written accelerations against Simbody's own forward dynamics, in systems that the tests
// build: force elements, `realize(Acceleration)`, all of Simbody's stages.
#include "sim_server/plants/multirotor/multirotor_dynamics.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace sls::sim {
namespace {

using SimTK::Body, SimTK::Inertia, SimTK::MassProperties, SimTK::MobilizedBody, SimTK::Rotation,
    SimTK::Vec3;

/// Uniform numbers in [-1, 1], the same on every machine.
class Numbers {
 public:
  double operator()() { return static_cast<double>(engine_()) / 2147483648.0 - 1.0; }
  Vec3 vector(double size) { return size * Vec3((*this)(), (*this)(), (*this)()); }
  /// Between 1 / `factor` and `factor`.
  double scale(double factor) { return std::pow(factor, (*this)()); }

 private:
  std::mt19937 engine_{1};
};

/// A free body with a pendulum under forces of Simbody's force subsystem.
struct Oracle {
  Oracle(const MassProperties& body_of, const Vec3& joint, const MassProperties& links,
         PendulumBody kind, double gravity)
      : matter(system),
        forces(system),
        gravity_force(forces, matter, Vec3(0, 0, gravity)),
        held(forces, matter),
        body(matter.Ground(), Body::Rigid(body_of)) {
    if (kind == PendulumBody::kPoint)
      pendulum =
          MobilizedBody::LineOrientation(body, joint, Body::Rigid(links), SimTK::Transform());
    else
      pendulum = MobilizedBody::Ball(body, joint, Body::Rigid(links), SimTK::Transform());
    state = system.realizeTopology();
    system.realize(state, SimTK::Stage::Instance);
  }

  SimTK::MultibodySystem system;
  SimTK::SimbodyMatterSubsystem matter;
  SimTK::GeneralForceSubsystem forces;
  SimTK::Force::UniformGravity gravity_force;
  SimTK::Force::DiscreteForces held;
  MobilizedBody::Free body;
  MobilizedBody pendulum;
  SimTK::State state;
};

/// A body with products of inertia and with the centre of mass away from its origin.
MassProperties make_body(Numbers& numbers) {
  const double mass = numbers.scale(5.0);
  const Vec3 centre = numbers.vector(0.1);
  const Rotation R(SimTK::BodyRotationSequence, numbers(), SimTK::XAxis, numbers(), SimTK::YAxis,
                   numbers(), SimTK::ZAxis);
  const Inertia central = mass * Inertia(0.02, 0.025, 0.03).reexpress(R);
  return {mass, centre, central.shiftFromMassCenter(centre, mass)};
}

void expect_same_accelerations(const MassProperties& body, const MassProperties& links,
                               PendulumBody kind, Numbers& numbers) {
  const double gravity = 9.8066;
  const Vec3 joint = numbers.vector(0.2), force_W = numbers.vector(30.0),
             torque_W = numbers.vector(1.0);
  Oracle oracle(body, joint, links, kind, gravity);
  const MultirotorDynamics dynamics(body, joint, links, kind, gravity);
  for (int i = 0; i < oracle.state.getNQ(); ++i) oracle.state.updQ()[i] = numbers();
  for (int i = 0; i < oracle.state.getNU(); ++i) oracle.state.updU()[i] = 3.0 * numbers();
  oracle.held.setOneBodyForce(oracle.state, oracle.body, {torque_W, force_W});
  oracle.system.realize(oracle.state, SimTK::Stage::Acceleration);

  const SimTK::State& state = oracle.state;
  const Rotation& R_WP = oracle.pendulum.getBodyRotation(state);
  const Vec3 w_WP_W = oracle.pendulum.getBodyAngularVelocity(state);
  const auto found = dynamics.calc_accelerations(
      {oracle.body.getBodyRotation(state), oracle.body.getBodyAngularVelocity(state), R_WP, w_WP_W},
      force_W, torque_W);

  const Vec3 b_expected = oracle.body.getBodyAngularAcceleration(state);
  const Vec3 a_expected = oracle.body.getBodyOriginAcceleration(state);
  const Vec3 p_expected = oracle.pendulum.getBodyAngularAcceleration(state);
  // Rounding of the summed terms. It is larger for a light body on a long lever.
  const auto calc_lever = [](const MassProperties& of, double arm) {
    return 1.0 + of.getMass() * arm * arm / SimTK::min(of.calcCentralInertia().getMoments());
  };
  const double lever =
      calc_lever(body, joint.norm()) *
      (kind == PendulumBody::kRigid ? calc_lever(links, links.getMassCenter().norm()) : 1.0);
  const double b_size = lever * (b_expected.norm() + 100.0),
               a_size = lever * (a_expected.norm() + 100.0);
  EXPECT_LE((found.b_WB_W - b_expected).norm(), 1e-12 * b_size);
  EXPECT_LE((found.a_WQ - a_expected).norm(), 1e-12 * a_size);
  const Vec3 n_W = R_WP.z();
  const Vec3 difference = found.b_WP_W - p_expected;
  // The spin of a point load has no meaning: its joint frame's spin is not compared.
  const Vec3 compared =
      kind == PendulumBody::kPoint ? difference - (~difference * n_W) * n_W : difference;
  const double p_size =
      p_expected.norm() + a_size / links.getMassCenter().norm() + w_WP_W.normSqr();
  EXPECT_LE(compared.norm(), 1e-12 * p_size);
  // The joint's force carries the pendulum: M (a_G − g) = −f, with f on the body.
  const Vec3 a_G = oracle.pendulum.findStationAccelerationInGround(state, links.getMassCenter());
  const double pull = links.getMass() * ~(Vec3(0, 0, gravity) - a_G) * n_W;
  EXPECT_NEAR(found.tension, pull, 1e-11 * links.getMass() * (a_size + p_size));
}

TEST(MultirotorDynamicsTest, AcceleratesBodyAndPointLoadAsSimbodyDoes) {
  Numbers numbers;
  for (int i = 0; i < 200 && !testing::Test::HasFailure(); ++i) {
    const double mass = 0.2 * numbers.scale(10.0);
    const Vec3 p_JL(0, 0, numbers.scale(5.0));
    expect_same_accelerations(make_body(numbers), {mass, p_JL, Inertia::pointMassAt(p_JL, mass)},
                              PendulumBody::kPoint, numbers);
  }
}

// The plant's pendulum has no spin about the rod; here it has one, and the axes of inertia differ.
TEST(MultirotorDynamicsTest, AcceleratesBodyAndRigidPendulumAsSimbodyDoes) {
  Numbers numbers;
  for (int i = 0; i < 200 && !testing::Test::HasFailure(); ++i) {
    const double mass = 0.2 * numbers.scale(10.0);
    const Vec3 p_JG(0, 0, numbers.scale(2.0));
    const Inertia central = mass * Inertia(0.03, 0.04, 0.02);
    expect_same_accelerations(make_body(numbers),
                              {mass, p_JG, central.shiftFromMassCenter(p_JG, mass)},
                              PendulumBody::kRigid, numbers);
  }
}

}  // namespace
}  // namespace sls::sim
