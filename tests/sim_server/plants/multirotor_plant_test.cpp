#include "sim_server/plants/multirotor/multirotor_plant.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <string>

#include "sim_server/autopilots/autopilot.hpp"
#include "sim_server/autopilots/first_order/keys.hpp"
#include "sim_server/autopilots/geometric/keys.hpp"
#include "sim_server/plants/multirotor/airframe.hpp"
#include "sim_server/plants/multirotor/keys.hpp"
#include "tests/oracle/multirotor_ode.hpp"
#include "tests/sim_server/plants/plant_flights.hpp"
#include "tests/support/errors.hpp"

namespace sls::sim {
namespace {

using Eigen::Matrix3d, Eigen::Quaterniond, Eigen::Vector3d;
namespace ode = oracle::multirotor;

constexpr double kWithoutLimit = 1e5;  // rad/s: above every set-point of these tests

/// A quadrotor of 1.5 kg in X, its load of 0.2 kg on 1 m; no lag, no losses, no limits.
PlantSetup make_ideal_setup() {
  MultirotorKeys keys;
  keys.inertia = {0.029, 0.031, 0.055};
  keys.rotor.thrust_constant = 5e-6;
  keys.rotor.torque_constant = 0.05;
  keys.rotor.max_speed = kWithoutLimit;
  for (const auto& [x, y, spin] :
       {std::tuple{0.13, 0.22, Spin::kCounterClockwise},
        std::tuple{-0.13, -0.20, Spin::kCounterClockwise},
        std::tuple{0.13, -0.22, Spin::kClockwise}, std::tuple{-0.13, 0.20, Spin::kClockwise}}) {
    RotorKeys rotor;
    rotor.position = {x, y, 0.0};
    rotor.spin = spin;
    keys.rotors.push_back(rotor);
  }
  PlantSetup setup;
  setup.plant.model.name = "multirotor";
  setup.plant.own = keys;
  PlantSetup::Vehicle vehicle;
  vehicle.initial.placed = config::Body::kQuadrotor;
  setup.vehicles = {vehicle};
  return setup;
}

MultirotorKeys& keys_of(PlantSetup& setup) { return setup.plant.own.edit<MultirotorKeys>(); }
const model::SlungLoadParameters& vehicle_of(const PlantSetup& setup) {
  return setup.vehicles[0].parameters;
}

PlantSetup with_autopilot(PlantSetup setup, const std::string& model, config::OwnValues own,
                          std::int64_t period_ns) {
  setup.autopilot.model.name = model;
  setup.autopilot.own = std::move(own);
  setup.autopilot.period_ns = period_ns;
  return setup;
}

/// All features of a multirotor: rod, offset, bodies, lag, losses, wind, disturbances.
PlantSetup make_full_setup(Pendulum pendulum) {
  PlantSetup setup = make_ideal_setup();
  MultirotorKeys& keys = keys_of(setup);
  keys.products = {0.001, -0.002, 0.0005};
  keys.rotor.max_speed = 1300.0;
  keys.rotor.lag_up = 0.0125;
  keys.rotor.lag_down = 0.025;
  keys.rotor.thrust_loss_speed = 25.0;
  keys.rotor.drag_constant = 2e-4;
  keys.rotor.rolling_constant = 1e-6;
  keys.rotors[1].axis = {0.02, 0.01, -1.0};
  keys.rotors[2].own.thrust_constant = 5.2e-6;
  keys.bodies = {{0.05, {0.1, 0.02, -0.03}, {1e-4, 1e-4, 1e-4}},
                 {0.02, {-0.05, 0.0, 0.04}, Vector3d::Zero()}};
  keys.attachment = {0.01, -0.02, 0.05};
  keys.disturbance_torque = {0.002, -0.001, 0.001};
  setup.plant.disturbance_W = {0.1, -0.2, 0.15};
  // The air always meets the hubs from above: if its direction reverses, the slope of (3) jumps.
  setup.plant.air.v_wind_W = {1.0, -0.5, 12.0};
  keys.pendulum = pendulum;
  if (pendulum == Pendulum::kRigid) {
    keys.rod = RodKeys{0.02, 0.45, {2e-3, 2e-3, 1e-5}};
    keys.load_inertia = Vector3d(8e-4, 8e-4, 6e-4);
  }
  config::InitialState& initial = setup.vehicles[0].initial;
  initial.position = {0.2, -0.3, -1.0};
  initial.v_WQ = {0.3, -0.2, 0.1};
  initial.rod = {0.4, -0.3, 0.6, -0.5};
  initial.q_WB = Quaterniond(0.95, 0.2, -0.1, 0.15).normalized();
  initial.w_WB_B = Vector3d(0.3, -0.4, 0.2);
  return setup;
}

// --- beside the oracle ---------------------------------------------------------------------------

ode::Vehicle make_oracle_vehicle(const PlantSetup& setup) {
  const auto& keys = setup.plant.own.get<MultirotorKeys>();
  ode::Vehicle vehicle;
  ode::Body bare;
  bare.mass = vehicle_of(setup).quad_mass;
  Matrix3d tensor = keys.inertia.asDiagonal();
  tensor(0, 1) = tensor(1, 0) = keys.products[0];
  tensor(0, 2) = tensor(2, 0) = keys.products[1];
  tensor(1, 2) = tensor(2, 1) = keys.products[2];
  bare.inertia_B = tensor;
  std::vector<ode::Body> bodies;
  for (const FixedBodyKeys& fixed : keys.bodies) {
    bare.mass -= fixed.mass;
    bodies.push_back({fixed.mass, fixed.position, Matrix3d(fixed.inertia.asDiagonal())});
  }
  bodies.push_back(bare);
  vehicle.body = ode::combine(bodies);
  for (const RotorKeys& described : keys.rotors) {
    ode::Rotor rotor;
    rotor.p_QR_B = described.position;
    rotor.axis_B = described.axis.normalized();
    rotor.spin = described.spin == Spin::kCounterClockwise ? 1 : -1;
    rotor.thrust_constant = described.own.thrust_constant.value_or(keys.rotor.thrust_constant);
    rotor.torque_constant = keys.rotor.torque_constant;
    rotor.min_speed = keys.rotor.min_speed;
    rotor.max_speed = keys.rotor.max_speed;
    rotor.lag_up = keys.rotor.lag_up;
    rotor.lag_down = keys.rotor.lag_down;
    if (keys.rotor.thrust_loss_speed > 0.0) rotor.loss_speed = keys.rotor.thrust_loss_speed;
    rotor.drag_constant = keys.rotor.drag_constant;
    rotor.rolling_constant = keys.rotor.rolling_constant;
    vehicle.rotors.push_back(rotor);
  }
  ode::Pendulum& pendulum = vehicle.pendulum;
  pendulum.p_QA_B = keys.attachment;
  pendulum.load_mass = vehicle_of(setup).load_mass;
  pendulum.load_distance = vehicle_of(setup).rod_length;
  if (keys.pendulum == Pendulum::kRigid) {
    pendulum.model = ode::PendulumModel::kRigid;
    pendulum.rod_mass = keys.rod->mass;
    pendulum.rod_distance = keys.rod->centre;
    pendulum.rod_inertia_across = keys.rod->inertia.x();
    pendulum.rod_inertia_along = keys.rod->inertia.z();
    pendulum.load_inertia_across = keys.load_inertia->x();
    pendulum.load_inertia_along = keys.load_inertia->z();
  }
  vehicle.gravity = vehicle_of(setup).gravity;
  return vehicle;
}

/// The oracle's state equal to the plant's. A rigid rod has no spin about its own axis: it begins
/// without spin, and no torque acts about this axis.
ode::State make_oracle_state(const PlantSetup& setup, const model::Measurement& at) {
  ode::State state;
  state.p_WQ = at.p_WQ;
  state.v_WQ = at.v_WQ;
  state.q_WB = at.attitude.q_WB;
  state.w_WB_B = at.attitude.w_WB_B;
  const auto rotors =
      static_cast<Eigen::Index>(setup.plant.own.get<MultirotorKeys>().rotors.size());
  for (Eigen::Index i = 0; i < rotors; ++i) state.rotor_speeds.push_back(at.signals[i]);
  const model::RodDirection rod = model::to_direction(at.rod);
  return ode::with_rod(state, rod.n_W, rod.n_dot_W);
}

/// Set-points that currently act on a vehicle with `rotors` rotors.
std::vector<double> list_set_points(const model::Measurement& at, std::size_t rotors) {
  const double* first = at.signals.data() + rotors;
  return {first, first + rotors};
}

double calc_turn(const Quaterniond& a, const Quaterniond& b) { return a.angularDistance(b); }

struct Differences {
  double position = 0.0, turn = 0.0, tension = 0.0;  // m, rad, N
  double tilt = 0.0;                                 // largest of the flight, in rad
};

constexpr double kFlightTime = 16.0;  // s

/// Manoeuvres of kFlightTime with a thrust that leans beyond 60° to all sides. The oracle gets the
/// vehicle's state every `section_s` seconds, otherwise only the set-points of the rotors.
Differences fly_beside_oracle(const PlantSetup& setup, double section_s, double lean_n) {
  MultirotorPlant plant(setup);
  const ode::Vehicle vehicle = make_oracle_vehicle(setup);
  ode::State state;
  ode::Inputs inputs;
  inputs.disturbance_force_W = setup.plant.disturbance_W;
  inputs.disturbance_torque_W = setup.plant.own.get<MultirotorKeys>().disturbance_torque;
  inputs.v_wind_W = setup.plant.air.v_wind_W;
  const double weight = vehicle_of(setup).total_mass() * vehicle_of(setup).gravity;
  const double step_s = 1e-9 * static_cast<double>(setup.plant.step_ns);
  const auto section = static_cast<int>(std::lround(section_s / step_s));
  // Substeps of 0.05 ms, for which the oracle's own error is below 1e-10 m.
  const int substeps = static_cast<int>(std::ceil(step_s / 0.00005));
  Differences largest;
  const auto steps = static_cast<int>(std::lround(kFlightTime / step_s));
  for (int k = 0; k < steps; ++k) {
    const double time = k * step_s;
    if (k % section == 0) state = make_oracle_state(setup, plant.measurement(0));
    const model::Measurement at = plant.measurement(0);
    const double lean = lean_n * std::pow(std::sin(0.6 * time), 6);
    const Vector3d force = Vector3d(lean * std::cos(time), lean * std::sin(time), -weight) -
                           1.5 * at.v_WQ - 1.0 * at.p_WQ;
    plant.advance({force}, 1);
    const model::Measurement& now = plant.measurement(0);
    inputs.rotor_set_points = list_set_points(now, vehicle.rotors.size());
    state = ode::step(state, inputs, vehicle, step_s, substeps);
    const ode::Point load = ode::calc_load(state, vehicle);
    largest.position =
        std::max({largest.position, (now.p_WQ - state.p_WQ).norm(), (now.p_WL - load.p_W).norm()});
    largest.turn = std::max(largest.turn, calc_turn(now.attitude.q_WB, state.q_WB));
    const double tension = ode::calc_rate(state, inputs, vehicle).tension;
    largest.tension =
        std::max(largest.tension, std::abs(now.signals[now.signals.size() - 1] - tension));
    largest.tilt = std::max(largest.tilt, calc_tilt(now.attitude.q_WB * Vector3d::UnitZ()));
  }
  return largest;
}

class MultirotorOracleTest : public testing::TestWithParam<Pendulum> {};
INSTANTIATE_TEST_SUITE_P(Pendulums, MultirotorOracleTest,
                         testing::Values(Pendulum::kIdeal, Pendulum::kRigid),
                         [](const auto& tested) {
                           return tested.param == Pendulum::kIdeal ? "Ideal" : "Rigid";
                         });

constexpr double kSixtyDegrees = M_PI / 3.0;

TEST_P(MultirotorOracleTest, FollowsNewtonAndEulerForSixteenSecondsBeyondSixtyDegrees) {
  // Effects that make a hovering vehicle unstable are left out: any error would grow by a factor of
  // 1000 within 32 s. An attitude error still moves the vehicle with g t²/2: 4e-6 m at a step of
  // 1 ms.
  PlantSetup setup = make_full_setup(GetParam());
  MultirotorKeys& keys = keys_of(setup);
  keys.rotor.drag_constant = keys.rotor.rolling_constant = keys.rotor.thrust_loss_speed = 0.0;
  keys.attachment = make_airframe(keys, vehicle_of(setup).quad_mass).p_BC;
  setup.plant.step_ns = 200'000;
  const Differences largest =
      fly_beside_oracle(with_autopilot(setup, "geometric", {}, 4'000'000), kFlightTime, 60.0);
  EXPECT_GT(largest.tilt, kSixtyDegrees) << "the flight does not lean";
  EXPECT_LE(largest.position, 1e-8);
  EXPECT_LE(largest.turn, 1e-8);
  EXPECT_LE(largest.tension, 1e-7);
}

TEST_P(MultirotorOracleTest, FollowsThemWithAllThatAMultirotorCanHave) {
  const PlantSetup setup = with_autopilot(make_full_setup(GetParam()), "geometric", {}, 4'000'000);
  const Differences largest = fly_beside_oracle(setup, 1.0, 90.0);
  EXPECT_GT(largest.tilt, kSixtyDegrees) << "the flight does not lean";
  EXPECT_LE(largest.position, 1e-8);
  EXPECT_LE(largest.turn, 1e-8);
  EXPECT_LE(largest.tension, 1e-7);
}

// --- conserved quantities and closed forms -------------------------------------------------------

/// `setup` in space: no gravity, no air; with zero force the rotors stop.
PlantSetup in_space(PlantSetup setup) {
  setup.vehicles[0].parameters.gravity = 0.0;
  setup.plant.air = {};
  setup.plant.disturbance_W.setZero();
  keys_of(setup).disturbance_torque.setZero();
  return setup;
}

TEST_P(MultirotorOracleTest, KeepsMomentaAndEnergyWithoutForce) {
  const PlantSetup setup = in_space(make_full_setup(GetParam()));
  const ode::Vehicle vehicle = make_oracle_vehicle(setup);
  MultirotorPlant plant(setup);
  const auto calc_all = [&] {
    const ode::State state = make_oracle_state(setup, plant.measurement(0));
    return std::tuple{ode::calc_linear_momentum(state, vehicle),
                      ode::calc_angular_momentum(state, vehicle), ode::calc_energy(state, vehicle)};
  };
  plant.advance({Vector3d::Zero()}, 500);  // until the rotors have stopped
  const auto [linear, angular, energy] = calc_all();
  plant.advance({Vector3d::Zero()}, 10'000);
  const auto [linear_after, angular_after, energy_after] = calc_all();
  EXPECT_LE((linear_after - linear).norm(), 1e-11 * linear.norm());
  EXPECT_LE((angular_after - angular).norm(), 1e-10 * angular.norm());
  EXPECT_NEAR(energy_after, energy, 1e-9 * energy);
}

TEST(MultirotorPlantTest, HoversAtTheWeightWithEveryRotorAtItsSpeed) {
  const PlantSetup setup = make_ideal_setup();
  MultirotorPlant plant(setup);
  const double weight = vehicle_of(setup).total_mass() * vehicle_of(setup).gravity;
  plant.advance({Vector3d(0, 0, -weight)}, 5000);
  const model::Measurement& at = plant.measurement(0);
  EXPECT_LE(at.p_WQ.norm(), 1e-11);
  for (int i = 0; i < 8; ++i)
    EXPECT_NEAR(at.signals[i], std::sqrt(weight / 4 / 5e-6), 1e-9) << plant.signals()[i].name;
  EXPECT_NEAR(at.signals[12], weight, 1e-12);  // thrust_set_n
  EXPECT_NEAR(at.signals[13], weight, 1e-12);  // thrust_n
  EXPECT_NEAR(at.signals[14], vehicle_of(setup).load_mass * vehicle_of(setup).gravity, 1e-12);
}

TEST(MultirotorPlantTest, TurnsRotorsWithTheExactLag) {
  PlantSetup setup = make_ideal_setup();
  keys_of(setup).rotor.lag_up = 0.0125;
  keys_of(setup).rotor.lag_down = 0.025;
  MultirotorPlant plant(setup);
  const auto calc_speed = [](double force) { return std::sqrt(force / 4 / 5e-6); };
  const double start = plant.measurement(0).signals[0];
  plant.advance({Vector3d(0, 0, -30)}, 20);
  const double faster = calc_speed(30) + (start - calc_speed(30)) * std::exp(-0.020 / 0.0125);
  EXPECT_NEAR(plant.measurement(0).signals[0], faster, 1e-12 * faster);
  plant.advance({Vector3d(0, 0, -5)}, 33);
  const double slower = calc_speed(5) + (faster - calc_speed(5)) * std::exp(-0.033 / 0.025);
  EXPECT_NEAR(plant.measurement(0).signals[0], slower, 1e-12 * slower);
}

TEST(MultirotorPlantTest, AddsTheParallelAxesOfTheBodiesFixedToIt) {
  PlantSetup setup = make_full_setup(Pendulum::kIdeal);
  const Airframe airframe = make_airframe(keys_of(setup), vehicle_of(setup).quad_mass);
  const ode::Body whole = make_oracle_vehicle(setup).body;
  EXPECT_NEAR(airframe.mass, whole.mass, 1e-15);
  EXPECT_LE((airframe.p_BC - whole.p_QC_B).norm(), 1e-15);
  EXPECT_LE((airframe.inertia_C_B - whole.inertia_B).norm(), 1e-15);
}

// --- the point mass as a limit -------------------------------------------------------------------

/// Largest distance to `slung_load` in 8 s under the same forces, m.
double calc_distance_to_point_mass(const PlantSetup& setup) {
  MultirotorPlant plant(setup);
  config::Plant config;
  config.initial = setup.vehicles[0].initial;
  SlungLoadPlant point_mass(vehicle_of(setup), config);
  double largest = 0.0;
  const auto steps = static_cast<std::int64_t>(1e9 * kStep) / setup.plant.step_ns;
  for (int k = 0; k < 8000; ++k) {
    const model::SlungLoadState& state = point_mass.state();
    const Vector3d force =
        calc_shaking_force(k * kStep, state.p_WQ, state.v_WQ, vehicle_of(setup).total_mass(),
                           vehicle_of(setup).gravity);
    point_mass.step(force);
    plant.advance({force}, steps);
    largest = std::max(largest, calc_position_difference(plant.measurement(0), point_mass.state()));
  }
  return largest;
}

TEST(MultirotorPlantTest, IsThePointMassWithIdealRotorsAndNoAutopilot) {
  PlantSetup setup = make_ideal_setup();
  setup.vehicles[0].initial.rod = {0.3, -0.2, 0.5, 0.4};
  EXPECT_LE(calc_distance_to_point_mass(setup), 1e-12);
}

TEST(MultirotorPlantTest, ComesToThePointMassWithTheFirstOrderOfLags) {
  const auto fly_with_lag = [](double lag_s) {
    PlantSetup setup = make_ideal_setup();
    setup.vehicles[0].initial.rod = {0.3, -0.2, 0.5, 0.4};
    keys_of(setup).rotor.lag_up = keys_of(setup).rotor.lag_down = lag_s;
    return calc_distance_to_point_mass(
        with_autopilot(setup, "first_order", FirstOrderKeys{lag_s}, 0));
  };
  const double at_8 = fly_with_lag(0.008), at_4 = fly_with_lag(0.004);
  EXPECT_LE(at_4, 0.1);
  EXPECT_NEAR(std::log2(at_8 / at_4), 1.0, 0.15);
}

TEST(MultirotorPlantTest, ComesToThePointMassWithTheFirstOrderOfAttitudeLoopAndLags) {
  const auto fly_with_rate = [](double rate) {  // rate of the attitude loop, rad/s
    PlantSetup setup = make_ideal_setup();
    MultirotorKeys& keys = keys_of(setup);
    keys.rotor.lag_up = keys.rotor.lag_down = 0.2 / rate;
    setup.plant.step_ns = 250'000;
    config::InitialState& initial = setup.vehicles[0].initial;
    initial.rod = {0.3, -0.2, 0.5, 0.4};
    // Begins along the first force: to jump there, a vehicle would need more than its thrust.
    initial.q_WB = calc_attitude_for(calc_shaking_force(0.0, initial.position, initial.v_WQ,
                                                        vehicle_of(setup).total_mass(),
                                                        vehicle_of(setup).gravity));
    const double inertia = keys.inertia.mean();
    return calc_distance_to_point_mass(with_autopilot(
        setup, "geometric", geometric::Keys{inertia * rate * rate, 2.0 * inertia * rate}, 250'000));
  };
  const double at_40 = fly_with_rate(40.0), at_80 = fly_with_rate(80.0);
  EXPECT_LE(at_80, 0.2);
  EXPECT_NEAR(std::log2(at_40 / at_80), 1.0, 0.2);
}

// --- the published attitude loop -----------------------------------------------------------------

/// The vehicle of a shipped scenario.
PlantSetup make_shipped_setup(const std::string& name) {
  const config::Scenario scenario =
      config::load_scenario(std::string(SLS_SOURCE_DIR) + "/config/scenarios/" + name + ".yaml");
  PlantSetup setup;
  setup.plant = scenario.plant;
  setup.autopilot = *scenario.autopilot;
  setup.folder = scenario.folder;
  PlantSetup::Vehicle vehicle;
  vehicle.parameters = scenario.vehicle;
  vehicle.initial = scenario.plant.initial;
  setup.vehicles = {vehicle};
  return setup;
}

TEST(MultirotorPlantTest, StepsInAttitudeAsFastAsThePublishedVehicle) {
  for (const Vector3d& about : {Vector3d(1, 0, 0), Vector3d(0, 1, 0)}) {
    SCOPED_TRACE(about.transpose());
    const PlantSetup setup = make_shipped_setup("px4_attitude");
    MultirotorPlant plant(setup);
    const Vector3d hover(0, 0, -vehicle_of(setup).total_mass() * vehicle_of(setup).gravity);
    const double step_rad = 0.1;
    const auto calc_angle = [&] {
      return calc_tilt(plant.measurement(0).attitude.q_WB * Vector3d::UnitZ());
    };
    plant.advance({hover}, 1000);
    EXPECT_LE(calc_angle(), 1e-6);
    const Vector3d tilted = Eigen::AngleAxisd(step_rad, about) * hover;
    int steps = 0;
    for (; steps < 1000 && calc_angle() < (1.0 - std::exp(-1.0)) * step_rad; ++steps)
      plant.advance({tilted}, 1);
    EXPECT_NEAR(steps * kStep, 0.17, 0.02);  // docs/study.md, The attitude loop
    plant.advance({tilted}, 2000);
    EXPECT_NEAR(calc_angle(), step_rad, 0.02 * step_rad);
  }
}

// --- determinism and errors ----------------------------------------------------------------------

TEST(MultirotorPlantTest, AdvancesInAnyNumberOfCallsWithTheSameBits) {
  const PlantSetup setup = with_autopilot(make_full_setup(Pendulum::kRigid), "first_order",
                                          FirstOrderKeys{0.1}, 3'000'000);
  MultirotorPlant at_once(setup), in_parts(setup);
  for (int period = 0; period < 100; ++period) {
    const std::vector<Vector3d> force = {Vector3d(0.01 * period, -0.3, -16.0)};
    at_once.advance(force, 7);
    for (const int steps : {2, 0, 4, 1}) in_parts.advance(force, steps);
    const model::Measurement &a = at_once.measurement(0), &b = in_parts.measurement(0);
    ASSERT_EQ(a.p_WQ, b.p_WQ);
    ASSERT_EQ(a.v_WL, b.v_WL);
    ASSERT_EQ(a.attitude.q_WB.coeffs(), b.attitude.q_WB.coeffs());
    ASSERT_EQ(a.signals, b.signals);
  }
}

std::string find_error(MultirotorPlant& plant, const Vector3d& f_Q_W, std::int64_t steps = 1) {
  return sls::test::find_error<std::runtime_error>([&] { plant.advance({f_Q_W}, steps); });
}

TEST(MultirotorPlantTest, RefusesAForceThatIsNotFiniteAndKeepsItsState) {
  MultirotorPlant plant(make_ideal_setup());
  plant.advance({Vector3d(0, 0, -16)}, 3);
  const Vector3d before = plant.measurement(0).p_WL;
  EXPECT_EQ(find_error(plant, {0, std::nan(""), 0}),
            "force_y_n is not finite after step 3 of the plant");
  EXPECT_EQ(plant.measurement(0).p_WL, before);
}

TEST(MultirotorPlantTest, AStepThatFailsUndoesThoseBeforeItInTheSameCall) {
  PlantSetup setup = make_ideal_setup();
  setup.vehicles[0].initial.w_WB_B = Vector3d(1e10, 2e10, 3e10);  // overflows after some steps
  MultirotorPlant plant(setup);
  const model::Measurement before = plant.measurement(0);
  const std::string defect = find_error(plant, {0, 0, -16}, 100);
  ASSERT_NE(defect.find("is not finite after step "), defect.npos);
  ASSERT_EQ(defect.find("after step 1 "), defect.npos) << "the first step must succeed";
  plant.advance({Vector3d(0, 0, -16)}, 0);  // measures again
  EXPECT_EQ(plant.measurement(0).p_WQ, before.p_WQ);
  EXPECT_EQ(plant.measurement(0).p_WL, before.p_WL);
  EXPECT_EQ(plant.measurement(0).attitude.q_WB.coeffs(), before.attitude.q_WB.coeffs());
  EXPECT_EQ(plant.measurement(0).signals, before.signals);
}

TEST(MultirotorPlantTest, RefusesRotorSpeedsThatAreNotFinite) {
  MultirotorPlant plant(make_ideal_setup());
  plant.advance({Vector3d(0, 0, -16)}, 3);
  EXPECT_EQ(find_error(plant, {0, 0, -1e200}),  // its square overflows
            "rotor_1_set_rad_s is not finite after step 3 of the plant");
}

TEST(MultirotorPlantTest, TumblesWithoutError) {
  PlantSetup setup = make_ideal_setup();
  setup.vehicles[0].initial.q_WB = Quaterniond(0, 1, 0, 0);
  setup.vehicles[0].initial.w_WB_B = Vector3d(20.0, 5.0, -8.0);
  MultirotorPlant plant(setup);
  EXPECT_NO_THROW(plant.advance({Vector3d(0, 0, -16)}, 2000));
  EXPECT_NEAR(plant.measurement(0).attitude.q_WB.norm(), 1.0, 1e-15);
}

TEST(MultirotorPlantTest, SaysOnceWhenARotorIsAtItsLargestSpeedForMoreThanASecond) {
  PlantSetup setup = make_ideal_setup();
  keys_of(setup).rotor.max_speed = 1000.0;
  MultirotorPlant plant(setup);
  const std::vector<Vector3d> full = {Vector3d(0, 0, -25)}, hover = {Vector3d(0, 0, -16)};
  plant.advance(hover, 500);
  plant.advance(full, 1000);
  EXPECT_TRUE(plant.take_remarks(0).empty()) << "a second is not more than a second";
  plant.advance(full, 2000);
  const auto remarks = plant.take_remarks(0);
  ASSERT_EQ(remarks.size(), 4u);
  EXPECT_EQ(remarks[0], "rotor 1 at its largest speed (1000 rad/s) for more than 1 s, since 0.5 s");
  plant.advance(hover, 1);
  plant.advance(full, 900);
  EXPECT_TRUE(plant.take_remarks(0).empty());
}

TEST(MultirotorPlantTest, SaysThatItCannotTurnAboutItsRotorsAxis) {
  PlantSetup setup = make_ideal_setup();
  keys_of(setup).rotor.torque_constant = 0.0;
  const auto remarks = MultirotorPlant(setup).take_remarks(0);
  ASSERT_EQ(remarks.size(), 1u);
  EXPECT_NE(remarks[0].find("no authority over yaw"), std::string::npos);
  EXPECT_TRUE(MultirotorPlant(make_ideal_setup()).take_remarks(0).empty());
}

}  // namespace
}  // namespace sls::sim
