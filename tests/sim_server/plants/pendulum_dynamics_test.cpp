// The hand-written products against Simbody's own forward dynamics, in systems that the tests
// build: force elements, `realize(Acceleration)`, all of Simbody's stages.
#include "sim_server/plants/slung_load/pendulum_dynamics.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "common/model/forces.hpp"
#include "sim_server/plants/slung_load/keys.hpp"
#include "tests/sim_server/plants/plant_flights.hpp"

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

/// A quadrotor with one of the pendulums, under forces of Simbody's force subsystem.
struct Oracle {
  Oracle(Pendulum pendulum_of, double quad_mass, const MassProperties& links, double gravity)
      : matter(system),
        forces(system),
        gravity_force(forces, matter, Vec3(0, 0, gravity)),
        held(forces, matter),
        quadrotor(matter.Ground(), Body::Rigid(MassProperties(quad_mass, Vec3(0), Inertia(0)))) {
    if (pendulum_of == Pendulum::kIdeal)
      pendulum = MobilizedBody::LineOrientation(quadrotor, Body::Rigid(links));
    else
      pendulum = MobilizedBody::Ball(quadrotor, Body::Rigid(links));
    state = system.realizeTopology();
    system.realize(state, SimTK::Stage::Instance);
  }

  void set_force(const Vec3& force_W) {
    held.setOneBodyForce(state, quadrotor, {Vec3(0), force_W});
  }

  SimTK::MultibodySystem system;
  SimTK::SimbodyMatterSubsystem matter;
  SimTK::GeneralForceSubsystem forces;
  SimTK::Force::UniformGravity gravity_force;
  SimTK::Force::DiscreteForces held;
  MobilizedBody::Translation quadrotor;
  MobilizedBody pendulum;
  SimTK::State state;
};

MassProperties make_point_load(double mass, double length) {
  const Vec3 p_QL(0, 0, length);
  return {mass, p_QL, Inertia::pointMassAt(p_QL, mass)};
}

/// The published rod and load below the joint, by the parallel axis theorem alone.
MassProperties make_links() {
  const double across = 8.333e-4 + 0.001 * 0.5 * 0.5 + 8e-4 + 0.2 * 1.1 * 1.1;
  return {0.201, Vec3(0, 0, (0.001 * 0.5 + 0.2 * 1.1) / 0.201),
          Inertia(across, across, 5e-5 + 8e-4)};
}

/// Expects equal accelerations of quadrotor and pendulum, in m/s² and rad/s² in W, from the
/// products and from Simbody.
void expect_same_accelerations(Pendulum pendulum, double quad_mass, const MassProperties& links,
                               double gravity, Numbers& numbers) {
  Oracle oracle(pendulum, quad_mass, links, gravity);
  const PendulumDynamics dynamics(oracle.quadrotor.getBodyMassProperties(oracle.state),
                                  oracle.pendulum.getBodyMassProperties(oracle.state), gravity);
  const Vec3 force_W = numbers.vector(30.0);
  for (int i = 0; i < oracle.state.getNQ(); ++i) oracle.state.updQ()[i] = numbers();
  for (int i = 0; i < oracle.state.getNU(); ++i) oracle.state.updU()[i] = 5.0 * numbers();
  oracle.set_force(force_W);
  oracle.system.realize(oracle.state, SimTK::Stage::Acceleration);

  const Rotation& R_WL = oracle.pendulum.getBodyRotation(oracle.state);
  const Vec3 w_L = ~R_WL * oracle.pendulum.getBodyAngularVelocity(oracle.state);
  const auto [a_WQ, b_L] = dynamics.calc_accelerations(R_WL, w_L, force_W);

  const Vec3 a_expected = oracle.quadrotor.getBodyOriginAcceleration(oracle.state);
  const Vec3 b_expected = oracle.pendulum.getBodyAngularAcceleration(oracle.state);
  // Rounding of the terms that both sum: weight, force and the rod's tension.
  const double a_size = gravity + force_W.norm() / quad_mass + a_expected.norm();
  const double b_size = a_size / links.getMassCenter().norm() + w_L.normSqr();
  EXPECT_LE((a_WQ - a_expected).norm(), 1e-12 * a_size);
  EXPECT_LE((R_WL * b_L - b_expected).norm(), 1e-12 * b_size);
}

TEST(PendulumDynamicsTest, AcceleratesAPointLoadAsSimbodyDoes) {
  Numbers numbers;
  for (int i = 0; i < 200 && !testing::Test::HasFailure(); ++i) {
    const double quad_mass = 1.5 * numbers.scale(10.0);
    const MassProperties load =
        make_point_load(0.2 * numbers.scale(10.0), 1.0 * numbers.scale(5.0));
    expect_same_accelerations(Pendulum::kIdeal, quad_mass, load, 9.8, numbers);
  }
}

// The flights have no spin about the rod; here it has one, and the axes of inertia differ.
TEST(PendulumDynamicsTest, AcceleratesARigidPendulumAsSimbodyDoes) {
  Numbers numbers;
  for (int i = 0; i < 200 && !testing::Test::HasFailure(); ++i) {
    expect_same_accelerations(Pendulum::kRigid, 1.5, make_links(), 9.8066, numbers);
    const Vec3 p_QC(0, 0, numbers.scale(5.0));
    const double mass = numbers.scale(10.0);
    const Inertia central = mass * Inertia(0.03, 0.04, 0.02);
    const MassProperties body(mass, p_QC, central.shiftFromMassCenter(p_QC, mass));
    expect_same_accelerations(Pendulum::kRigid, numbers.scale(10.0), body, 9.8, numbers);
  }
}

/// Classical Runge-Kutta step of fourth order of Simbody's whole state y.
template <typename ForceAt>
void step_oracle(Oracle& oracle, double h, const ForceAt& force_at) {
  const SimTK::Vector start = oracle.state.getY();
  const auto calc_rate = [&](const SimTK::Vector& y) -> SimTK::Vector {
    oracle.state.updY() = y;
    oracle.set_force(force_at(Vec3::getAs(&oracle.state.getU()[0])));
    oracle.system.realize(oracle.state, SimTK::Stage::Acceleration);
    return oracle.state.getYDot();
  };
  const SimTK::Vector k1 = calc_rate(start);
  const SimTK::Vector k2 = calc_rate(start + h / 2 * k1);
  const SimTK::Vector k3 = calc_rate(start + h / 2 * k2);
  const SimTK::Vector k4 = calc_rate(start + h * k3);
  oracle.state.updY() = start + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4);
  SimTK::Vec4& rod = SimTK::Vec4::updAs(&oracle.state.updQ()[3]);
  rod /= rod.norm();
  oracle.system.realize(oracle.state, SimTK::Stage::Velocity);
}

TEST(PendulumDynamicsTest, FliesAsSimbodyDoesWithDragAndDisturbance) {
  for (const Pendulum pendulum : {Pendulum::kIdeal, Pendulum::kRigid}) {
    model::SlungLoadParameters vehicle;
    vehicle.rod_length = 1.1;
    config::Plant config;
    config.own = SlungLoadKeys{pendulum};
    config.initial.position = {0.0, 0.0, 1.1};
    config.initial.rod = {0.4, -0.3, 0.5, 1.0};
    config.initial.v_WQ = {0.3, -0.2, 0.1};
    config.air = {0.35, {2.0, -1.0, 0.5}};
    config.disturbance_W = {0.2, 0.1, -0.3};
    SlungLoadPlant plant(vehicle, config);

    Oracle oracle(
        pendulum, vehicle.quad_mass,
        pendulum == Pendulum::kIdeal ? make_point_load(vehicle.load_mass, 1.1) : make_links(),
        vehicle.gravity);
    const auto to_vec3 = [](const Eigen::Vector3d& v) { return Vec3(v.x(), v.y(), v.z()); };
    const auto to_eigen = [](const Vec3& v) { return Eigen::Vector3d(v[0], v[1], v[2]); };
    const model::RodDirection rod = model::to_direction(config.initial.rod);
    oracle.quadrotor.setQToFitTranslation(oracle.state, to_vec3(plant.state().p_WQ));
    oracle.quadrotor.setUToFitLinearVelocity(oracle.state, to_vec3(plant.state().v_WQ));
    oracle.pendulum.setQToFitRotation(
        oracle.state, Rotation(SimTK::BodyRotationSequence, 0.4, SimTK::XAxis, -0.3, SimTK::YAxis));
    oracle.pendulum.setUToFitAngularVelocity(oracle.state, to_vec3(rod.n_W.cross(rod.n_dot_W)));
    oracle.system.realize(oracle.state, SimTK::Stage::Velocity);

    double position_error = 0.0, velocity_error = 0.0;
    for (int k = 0; k < 4000; ++k) {
      Vec3 p_WL, v_WL;
      oracle.pendulum.findStationLocationAndVelocityInGround(oracle.state, Vec3(0, 0, 1.1), p_WL,
                                                             v_WL);
      const Eigen::Vector3d p_WQ = to_eigen(oracle.quadrotor.getBodyOriginLocation(oracle.state));
      const Eigen::Vector3d v_WQ = to_eigen(oracle.quadrotor.getBodyOriginVelocity(oracle.state));
      const model::SlungLoadState expected =
          model::make_state(p_WQ, v_WQ, to_eigen(p_WL), to_eigen(v_WL));
      position_error = std::max(position_error, calc_position_difference(plant.state(), expected));
      velocity_error = std::max(velocity_error, calc_velocity_difference(plant.state(), expected));

      const Eigen::Vector3d f_Q_W = calc_shaking_force(k * kStep, p_WQ, v_WQ, 1.7, 9.8);
      plant.step(f_Q_W);
      step_oracle(oracle, kStep, [&](const Vec3& v) {
        return to_vec3(f_Q_W + config.disturbance_W +
                       model::calc_rotor_drag(f_Q_W, to_eigen(v), config.air));
      });
    }
    // Same integrator and same equations: only 4,000 roundings of numbers up to 10 remain.
    EXPECT_LE(position_error, 1e-12);
    EXPECT_LE(velocity_error, 1e-12);
  }
}

}  // namespace
}  // namespace sls::sim
