// Compares the oracle of the multirotor with closed forms, conserved quantities and the oracles of
// the point mass.
#include "tests/oracle/multirotor_ode.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "tests/support/random_vectors.hpp"

namespace sls::oracle::multirotor {
namespace {

using Eigen::AngleAxisd;
using Eigen::Matrix3d;
using Eigen::Vector3d;

using test::draw_vector;

Pendulum make_pendulum(PendulumModel model) {
  Pendulum pendulum;
  pendulum.model = model;
  pendulum.p_QA_B << 0.05, -0.03, 0.08;
  pendulum.load_mass = 0.3;
  pendulum.load_distance = 0.9;
  pendulum.rod_mass = 0.05;
  pendulum.rod_distance = 0.45;
  pendulum.rod_inertia_across = 4e-3;
  pendulum.rod_inertia_along = 1e-4;
  pendulum.load_inertia_across = 1e-3;
  pendulum.load_inertia_along = 8e-4;
  return pendulum;
}

/// A vehicle without symmetry and off centre: full inertia, a sensor, canted rotors with loss and
/// drag.
Vehicle make_vehicle(PendulumModel model) {
  Vehicle vehicle;
  Body base, sensor;
  base.mass = 1.4;
  base.inertia_B << 0.03, 0.002, -0.001, 0.002, 0.04, 0.003, -0.001, 0.003, 0.06;
  sensor.mass = 0.2;
  sensor.p_QC_B << 0.1, 0.02, -0.06;
  sensor.inertia_B = 2e-4 * Matrix3d::Identity();
  vehicle.body = combine({base, sensor});
  const double places[4][2] = {{0.13, 0.22}, {-0.13, -0.20}, {0.13, -0.22}, {-0.13, 0.20}};
  for (int i = 0; i < 4; ++i) {
    Rotor rotor;
    rotor.p_QR_B << places[i][0], places[i][1], -0.02;
    rotor.axis_B = Vector3d(0.05 * i, -0.03, -1.0).normalized();
    rotor.spin = i < 2 ? 1 : -1;
    rotor.thrust_constant = 5e-6;
    rotor.torque_constant = 0.05;
    rotor.max_speed = 1100.0;
    rotor.lag_up = 0.0125;
    rotor.lag_down = 0.025;
    rotor.loss_speed = 25.0;
    rotor.drag_constant = 8e-5;
    rotor.rolling_constant = 1e-6;
    vehicle.rotors.push_back(rotor);
  }
  vehicle.pendulum = make_pendulum(model);
  vehicle.gravity = 9.81;
  return vehicle;
}

/// A body with its centre at Q and no rotors.
Vehicle make_bare_vehicle(PendulumModel model, const Vector3d& inertia) {
  Vehicle vehicle;
  vehicle.body.mass = 1.6;
  vehicle.body.inertia_B = inertia.asDiagonal();
  vehicle.pendulum = make_pendulum(model);
  vehicle.gravity = 9.81;
  return vehicle;
}

State draw_state(std::mt19937& generator, std::size_t rotors) {
  State state;
  state.p_WQ = draw_vector(generator, 2.0);
  state.v_WQ = draw_vector(generator, 2.0);
  const Vector3d turn = draw_vector(generator, 1.5);
  state.q_WB = AngleAxisd(turn.norm(), turn.normalized());
  state.w_WB_B = draw_vector(generator, 2.0);
  const Vector3d n = draw_vector(generator, 1.0).normalized();
  state = with_rod(state, n, n.cross(draw_vector(generator, 2.0)), draw_vector(generator, 2.0).x());
  std::uniform_real_distribution<double> speed(200.0, 1000.0);
  for (std::size_t i = 0; i < rotors; ++i) state.rotor_speeds.push_back(speed(generator));
  return state;
}

Inputs draw_inputs(std::mt19937& generator) {
  Inputs inputs;
  inputs.f_Q_W = draw_vector(generator, 5.0);
  inputs.disturbance_force_W = draw_vector(generator, 1.0);
  inputs.disturbance_torque_W = draw_vector(generator, 0.1);
  inputs.v_wind_W = draw_vector(generator, 3.0);
  return inputs;
}

/// Derivative of `quantity` along the equations of motion, by a central difference. Its truncation
/// is about 1e-10 of the third derivative, and its rounding error is as large.
template <typename Quantity>
auto differentiate(const Quantity& quantity, const State& state, const Rate& rate)
    -> decltype(quantity(state)) {
  const double h = 1e-5;
  return (quantity(advance(state, rate, h)) - quantity(advance(state, rate, -h))) / (2.0 * h);
}

// The equations.

TEST(MultirotorOdeTest, AssemblesBodiesByTheParallelAxisTheorem) {
  // Two point masses and a cube: about the common centre c, J = Σ m_i (|r_i|² I − r_i r_iᵀ) + J_0.
  Body cube, left, right;
  cube.mass = 2.0;
  cube.inertia_B = 0.1 * Matrix3d::Identity();
  left.mass = right.mass = 1.0;
  left.p_QC_B << 0.0, -0.5, 0.4;
  right.p_QC_B << 0.0, 0.5, 0.4;
  const Body whole = combine({cube, left, right});
  EXPECT_DOUBLE_EQ(whole.mass, 4.0);
  EXPECT_LE((whole.p_QC_B - Vector3d(0.0, 0.0, 0.2)).norm(), 1e-16);
  // 0.1 + 2·0.2² + 2·(0.5² + 0.2²); 0.1 + 2·0.2² + 2·0.2²; 0.1 + 2·0.5².
  const Vector3d expected(0.76, 0.26, 0.6);
  EXPECT_LE((whole.inertia_B - Matrix3d(expected.asDiagonal())).norm(), 1e-15);
  // Order and grouping make no difference.
  const Body again = combine({right, combine({left, cube})});
  EXPECT_LE((again.inertia_B - whole.inertia_B).norm(), 1e-15);
}

TEST(MultirotorOdeTest, ObeysTheLawsOfMomentumAndEnergyInAnyState) {
  // Momenta and energy are functions of positions and velocities, and forces come from the wrench:
  // neither uses the solution for the joint's force.
  std::mt19937 generator(1);
  for (const PendulumModel model :
       {PendulumModel::kNone, PendulumModel::kIdeal, PendulumModel::kRigid}) {
    const Vehicle vehicle = make_vehicle(model);
    const PendulumMass pendulum = calc_mass(vehicle.pendulum);
    for (int i = 0; i < 200; ++i) {
      const State state = draw_state(generator, vehicle.rotors.size());
      const Inputs inputs = draw_inputs(generator);
      const Rate rate = calc_rate(state, inputs, vehicle);
      const Vector3d p_WO = draw_vector(generator, 1.0), g(0.0, 0.0, vehicle.gravity);

      const Point centre = calc_body_point(state, vehicle.body.p_QC_B);
      const Point rod = calc_rod_point(state, vehicle, pendulum.centre);
      const Vector3d at_origin = inputs.f_Q_W + inputs.disturbance_force_W;
      const Vector3d weights = vehicle.body.mass * g + pendulum.mass * g;
      Vector3d force = at_origin + weights;
      Vector3d torque = inputs.disturbance_torque_W + (state.p_WQ - p_WO).cross(at_origin) +
                        (centre.p_W - p_WO).cross(vehicle.body.mass * g) +
                        (rod.p_W - p_WO).cross(pendulum.mass * g);
      const auto rotors = calc_rotor_forces(state, inputs, vehicle);
      for (std::size_t k = 0; k < rotors.size(); ++k) {
        const Point hub = calc_body_point(state, vehicle.rotors[k].p_QR_B);
        force += state.q_WB * rotors[k].force_B;
        torque += (hub.p_W - p_WO).cross(state.q_WB * rotors[k].force_B) +
                  state.q_WB * rotors[k].torque_B;
      }
      const auto linear = [&](const State& at) { return calc_linear_momentum(at, vehicle); };
      const auto angular = [&](const State& at) {
        return calc_angular_momentum(at, vehicle, p_WO);
      };
      const auto energy = [&](const State& at) { return calc_energy(at, vehicle); };
      ASSERT_LE((differentiate(linear, state, rate) - force).norm(), 1e-6);
      ASSERT_LE((differentiate(angular, state, rate) - torque).norm(), 1e-6);
      ASSERT_NEAR(differentiate(energy, state, rate), calc_power(state, inputs, vehicle), 1e-6);

      // Weight and joint force act on the pendulum; only the joint force has a moment about its
      // centre.
      if (model == PendulumModel::kNone) continue;
      const auto rod_momentum = [&](const State& at) {
        return Vector3d(pendulum.mass * calc_rod_point(at, vehicle, pendulum.centre).v_W);
      };
      const auto spin = [&](const State& at) { return calc_pendulum_spin(at, vehicle); };
      ASSERT_LE((differentiate(rod_momentum, state, rate) - pendulum.mass * g + rate.f_A_W).norm(),
                1e-6);
      const Vector3d joint_torque = pendulum.centre * state.n_W.cross(rate.f_A_W);
      ASSERT_LE((differentiate(spin, state, rate) - joint_torque).norm(), 1e-6);
      // n · n̈ = −|ṅ|² keeps the rod's length.
      ASSERT_NEAR(state.n_W.dot(rate.n_ddot_W), -state.n_dot_W.squaredNorm(), 1e-11);
    }
  }
}

// Rotors.

/// A body with one rotor at its centre, no pendulum, no gravity.
Vehicle make_single_rotor_vehicle() {
  Vehicle vehicle = make_bare_vehicle(PendulumModel::kNone, {0.03, 0.04, 0.06});
  vehicle.gravity = 0.0;
  vehicle.rotors.resize(1);
  vehicle.rotors[0].thrust_constant = 2e-5;
  return vehicle;
}

TEST(MultirotorOdeTest, RotorSpeedsAreExactForAnyStep) {
  Vehicle vehicle = make_single_rotor_vehicle();
  Rotor& rotor = vehicle.rotors[0];
  rotor.min_speed = 100.0;
  rotor.max_speed = 1100.0;
  rotor.lag_up = 0.0125;
  rotor.lag_down = 0.025;
  State state;
  state.rotor_speeds = {500.0};
  Inputs inputs;
  const auto speed_after = [&](double set_point, double duration, int substeps) {
    inputs.rotor_set_points = {set_point};
    return step(state, inputs, vehicle, duration, substeps).rotor_speeds[0];
  };
  EXPECT_NEAR(speed_after(900.0, 0.01, 1), 900.0 - 400.0 * std::exp(-0.01 / 0.0125), 1e-12);
  EXPECT_NEAR(speed_after(300.0, 0.01, 7), 300.0 + 200.0 * std::exp(-0.01 / 0.025), 1e-12);
  EXPECT_NEAR(speed_after(5000.0, 0.01, 3), 1100.0 - 600.0 * std::exp(-0.01 / 0.0125), 1e-12);
  EXPECT_NEAR(speed_after(-5.0, 0.01, 3), 100.0 + 400.0 * std::exp(-0.01 / 0.025), 1e-12);
  rotor.lag_up = 0.0;
  EXPECT_EQ(speed_after(900.0, 1e-9, 1), 900.0);
}

TEST(MultirotorOdeTest, RisesAndSinksAsTheThrustLossSays) {
  // Upward velocity u with thrust T, loss slope k = T / (m v_loss), b = T / m − g:
  // u̇ = b + k u while u < 0 (b > 0), u̇ = b − k u afterwards. A wind of 1 m/s downwards shifts u.
  Vehicle vehicle = make_single_rotor_vehicle();
  vehicle.gravity = 9.81;
  vehicle.rotors[0].loss_speed = 25.0;
  State state;
  state.rotor_speeds = {1000.0};
  state.v_WQ << 0.0, 0.0, 3.0 + 1.0;
  Inputs inputs;
  inputs.v_wind_W << 0.0, 0.0, 1.0;
  const double thrust = 20.0 / 1.6, k = thrust / 25.0, b = thrust - 9.81, u_0 = -3.0;
  // u = −b/k + (u_0 + b/k) e^(kt) crosses zero at t_0. A step that does not end there has a larger
  // error, because of the kink.
  const double t_0 = std::log(b / k / (u_0 + b / k)) / k;
  ASSERT_GT(t_0, 0.1);
  ASSERT_LT(t_0, 2.9);
  state = step(state, inputs, vehicle, 3.0, 487);
  const double u = b / k * (1.0 - std::exp(-k * (3.0 - t_0)));
  EXPECT_NEAR(state.v_WQ.z() - 1.0, -u, 1e-11);
  // Beyond v_loss there is no thrust.
  state.v_WQ << 0.0, 0.0, -30.0;
  EXPECT_EQ(calc_rotor_forces(state, inputs, vehicle)[0].thrust, 0.0);
  EXPECT_NEAR(calc_rate(state, inputs, vehicle).a_WQ.z(), 9.81, 1e-14);
}

TEST(MultirotorOdeTest, DriftsWithTheWindByRotorDrag) {
  // m v̇_⊥ = −|w| k_d (v_⊥ − v_wind): exponential; along the axis there is no drag.
  Vehicle vehicle = make_single_rotor_vehicle();
  vehicle.rotors[0].thrust_constant = 0.0;
  vehicle.rotors[0].drag_constant = 1e-3;
  State state;
  state.rotor_speeds = {800.0};
  state.v_WQ << 1.0, 0.0, 0.5;
  Inputs inputs;
  inputs.v_wind_W << 4.0, -2.0, 3.0;
  state = step(state, inputs, vehicle, 2.0, 400);
  const double left = std::exp(-800.0 * 1e-3 / 1.6 * 2.0);
  EXPECT_LE((state.v_WQ - Vector3d(4.0 - 3.0 * left, -2.0 + 2.0 * left, 0.5)).norm(), 1e-11);
}

TEST(MultirotorOdeTest, TurnsTheBodyAsItsRotorsSay) {
  Vehicle vehicle = make_single_rotor_vehicle();
  Rotor& rotor = vehicle.rotors[0];
  rotor.torque_constant = 0.05;
  State state;
  state.rotor_speeds = {1000.0};
  const auto calc_turn = [&] { return calc_rate(state, {}, vehicle).w_WB_B_dot; };
  // Counter-clockwise from above: the body is turned clockwise from above, +z. T = 20 N.
  EXPECT_LE((calc_turn() - Vector3d(0, 0, 1.0 / 0.06)).norm(), 1e-12);
  rotor.spin = -1;
  EXPECT_LE((calc_turn() + Vector3d(0, 0, 1.0 / 0.06)).norm(), 1e-12);
  // Thrust at the right pushes the right side up: a negative roll. At the front: nose up.
  rotor.torque_constant = 0.0;
  rotor.p_QR_B << 0.0, 0.2, 0.0;
  EXPECT_LE((calc_turn() - Vector3d(-4.0 / 0.03, 0, 0)).norm(), 1e-12);
  rotor.p_QR_B << 0.2, 0.0, 0.0;
  EXPECT_LE((calc_turn() - Vector3d(0, 4.0 / 0.04, 0)).norm(), 1e-12);
  // Rolling moment −|w| k_r v_⊥, here of a hub that moves along y at a yaw rate of 3 rad/s.
  rotor.thrust_constant = 0.0;
  rotor.rolling_constant = 1e-5;
  state.w_WB_B << 0.0, 0.0, 3.0;
  EXPECT_LE((calc_turn() - Vector3d(0.0, -1000.0 * 1e-5 * 0.6 / 0.04, 0.0)).norm(), 1e-12);
}

// The method.

TEST(MultirotorOdeTest, ConvergesWithTheFourthPowerOfTheStep) {
  // With all effects, also hubs whose axial velocity changes its sign during the flight.
  for (const PendulumModel model :
       {PendulumModel::kNone, PendulumModel::kIdeal, PendulumModel::kRigid}) {
    const Vehicle vehicle = make_vehicle(model);
    const auto fly = [&](int substeps) {
      std::mt19937 generator(7);
      State state = draw_state(generator, 4);
      Inputs inputs = draw_inputs(generator);
      inputs.rotor_set_points = {900.0, 300.0, 700.0, 800.0};
      return step(state, inputs, vehicle, 0.5, substeps);
    };
    const State best = fly(3200);
    const auto calc_error = [&](int substeps) {
      const State state = fly(substeps);
      return (calc_load(state, vehicle).p_W - calc_load(best, vehicle).p_W).norm() +
             (state.p_WQ - best.p_WQ).norm() + (state.w_WB_B - best.w_WB_B).norm() +
             (state.q_WB.coeffs() - best.q_WB.coeffs()).norm();
    };
    EXPECT_NEAR(std::log2(calc_error(100) / calc_error(200)), 4.0, 0.3);
    EXPECT_LE(calc_error(400), 1e-7);
  }
}

}  // namespace
}  // namespace sls::oracle::multirotor
