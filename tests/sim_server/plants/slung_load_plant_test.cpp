#include "sim_server/plants/slung_load/slung_load_plant.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <string>

#include "common/model/invariants.hpp"
#include "sim_server/plants/slung_load/keys.hpp"
#include "tests/sim_server/plants/plant_flights.hpp"
#include "tests/support/errors.hpp"

namespace sls::sim {
namespace {

const model::SlungLoadParameters kVehicle;  // 1.5 kg, 0.2 kg, 1 m, 9.8 m/s²

Eigen::Vector3d calc_hover_force() {
  return calc_weight_force(kVehicle.total_mass(), kVehicle.gravity);
}

Eigen::Vector3d calc_centre_of_mass(const model::SlungLoadState& state) {
  return (kVehicle.quad_mass * state.p_WQ + kVehicle.load_mass * state.p_WL) /
         kVehicle.total_mass();
}

/// A moving plant with a swing in every direction.
config::Plant make_swinging_plant() {
  config::Plant plant;
  plant.initial.rod = {0.5, -0.4, 0.7, 1.1};
  plant.initial.v_WQ = {0.4, -0.3, 0.2};
  return plant;
}

std::string get_error(SlungLoadPlant& plant, const Eigen::Vector3d& f_Q_W) {
  return test::find_error<std::runtime_error>([&] { plant.step(f_Q_W); });
}

// --- initial state -----------------------------------------------------------------------------

TEST(SlungLoadPlantTest, HangsBelowTheQuadrotorByDefault) {
  config::Plant config;
  config.initial.position = {0.0, 0.0, -0.5};
  const model::SlungLoadState state = SlungLoadPlant(kVehicle, config).state();
  EXPECT_EQ(state.p_WL, Eigen::Vector3d(0.0, 0.0, -0.5));
  EXPECT_EQ(state.p_WQ, Eigen::Vector3d(0.0, 0.0, -1.5));
  EXPECT_EQ(state.v_WQ, Eigen::Vector3d::Zero());
  EXPECT_EQ(state.v_WL, Eigen::Vector3d::Zero());
  EXPECT_EQ(state.rod.alpha, 0.0);
  EXPECT_EQ(state.rod.beta_dot, 0.0);
}

TEST(SlungLoadPlantTest, BeginsWithTheAnglesRatesAndVelocityOfTheScenario) {
  for (const config::Body placed : {config::Body::kQuadrotor, config::Body::kLoad}) {
    for (const Pendulum pendulum : {Pendulum::kIdeal, Pendulum::kRigid}) {
      config::Plant config = make_swinging_plant();
      config.own = SlungLoadKeys{pendulum};
      config.initial.placed = placed;
      config.initial.position = {1.0, 2.0, -4.0};
      model::SlungLoadParameters vehicle = kVehicle;
      vehicle.rod_length = 1.1;
      const model::SlungLoadState state = SlungLoadPlant(vehicle, config).state();
      // Rounding of numbers up to 4, divided by cos β.
      const double rounding = 1e-14;
      const Eigen::Vector3d n_W(std::sin(-0.4), -std::sin(0.5) * std::cos(-0.4),
                                std::cos(0.5) * std::cos(-0.4));
      const Eigen::Vector3d& p_placed = placed == config::Body::kLoad ? state.p_WL : state.p_WQ;
      EXPECT_LE((p_placed - config.initial.position).norm(), rounding);
      EXPECT_LE((state.p_WL - state.p_WQ - 1.1 * n_W).norm(), rounding);
      EXPECT_LE((state.v_WQ - config.initial.v_WQ).norm(), rounding);
      EXPECT_NEAR((state.v_WL - state.v_WQ).x(), 1.1 * std::cos(-0.4) * 1.1,
                  rounding);  // L cos β β̇
      EXPECT_NEAR(state.rod.alpha, 0.5, rounding);
      EXPECT_NEAR(state.rod.beta, -0.4, rounding);
      EXPECT_NEAR(state.rod.alpha_dot, 0.7, rounding);
      EXPECT_NEAR(state.rod.beta_dot, 1.1, rounding);
    }
  }
}

TEST(SlungLoadPlantTest, RatesAreTheAnglesTrueDerivatives) {
  config::Plant config = make_swinging_plant();
  model::SlungLoadParameters vehicle = kVehicle;
  vehicle.rod_length = 0.4;
  SlungLoadPlant plant(vehicle, config);
  const model::RodAngles before = plant.state().rod;
  plant.step(calc_hover_force());
  const model::RodAngles middle = plant.state().rod;
  plant.step(calc_hover_force());
  const model::RodAngles after = plant.state().rod;
  // Central difference: h²/6 times the third derivative, about 1e-7 · 6³.
  EXPECT_NEAR((after.alpha - before.alpha) / (2 * kStep), middle.alpha_dot, 1e-4);
  EXPECT_NEAR((after.beta - before.beta) / (2 * kStep), middle.beta_dot, 1e-4);
}

// --- closed forms ------------------------------------------------------------------------------

TEST(SlungLoadPlantTest, FallsFreelyWhileItsRodTurnsUniformlyOverTheTop) {
  // The rod turns in the plane y = 0. It passes β = ±π/2 and the point above the quadrotor.
  const double rate = 7.0;
  config::Plant config;
  config.initial.rod.beta_dot = rate;
  SlungLoadPlant plant(kVehicle, config);
  const Eigen::Vector3d start = calc_centre_of_mass(plant.state());
  const Eigen::Vector3d v_WC(kVehicle.load_mass / kVehicle.total_mass() * rate, 0.0, 0.0);
  double highest = 0.0;
  for (int k = 1; k <= 2000; ++k) {
    plant.step(Eigen::Vector3d::Zero());
    const model::SlungLoadState state = plant.state();
    const double time = k * kStep, angle = rate * time;
    const Eigen::Vector3d n_W(std::sin(angle), 0.0, std::cos(angle));
    // Phase error (ωh)⁴/120 = 2e-11 per radian, 14 radians.
    ASSERT_LE((state.p_WL - state.p_WQ - n_W).norm(), 1e-9) << "step " << k;
    const Eigen::Vector3d fallen = v_WC * time + Eigen::Vector3d(0, 0, 0.5 * 9.8 * time * time);
    ASSERT_LE((calc_centre_of_mass(state) - start - fallen).norm(), 1e-9) << "step " << k;
    ASSERT_NEAR(std::sin(state.rod.beta), n_W.x(), 1e-9);
    ASSERT_NEAR(std::abs(state.rod.alpha), n_W.z() > 0.0 ? 0.0 : M_PI, 1e-9);
    // While the load is above the quadrotor, β decreases and α has jumped by π. The rod comes
    // within 3e-4 rad of level; even there α̇ = −n_dot_y / cos β is only rounding.
    ASSERT_NEAR(state.rod.beta_dot, n_W.z() > 0.0 ? rate : -rate, 1e-8);
    ASSERT_NEAR(state.rod.alpha_dot, 0.0, 1e-9);
    highest = std::max(highest, -state.rod.beta);
  }
  EXPECT_GT(highest, 1.56);  // near π/2 = 1.5708
}

TEST(SlungLoadPlantTest, StaysWhereItHoversAtItsWeight) {
  config::Plant config;
  config.initial.position = {1.0, -2.0, -0.5};
  SlungLoadPlant plant(kVehicle, config);
  fly(plant, calc_hover_force(), 10'000);
  // Rounding of the weight (2e-15 N of 17 N) over 10 s.
  EXPECT_LE((plant.state().p_WL - config.initial.position).norm(), 1e-12);
  EXPECT_LE(plant.state().v_WL.norm(), 1e-13);
  EXPECT_EQ(plant.state().rod.alpha, 0.0);
}

// ω² = (m + m_L) g / (m L), not g/L, because the quadrotor also swings. Under a vertical force
// equal to the weight the planar swing is exactly β̈ = −ω² sin β: its period is known for any
// amplitude.
TEST(SlungLoadPlantTest, SwingsAboutHoverWithItsPeriod) {
  const double omega = std::sqrt(1.7 * 9.8 / (1.5 * 1.0));
  for (const double amplitude : {0.01, 0.35, 1.5}) {
    config::Plant config;
    config.initial.rod.beta = amplitude;
    SlungLoadPlant plant(kVehicle, config);
    // Runge-Kutta's phase error is (ωh)⁴/120 ≈ 1e-12, the interpolation's h⁴ of the same size.
    EXPECT_NEAR(find_first_hang(plant, calc_hover_force()), calc_quarter_period(omega, amplitude),
                1e-11);
  }
}

// The centre of mass rests and carries no net force; quadrotor and load circle about the vertical
// through it, on opposite sides, at Ω² = (m + m_L) g / (m L cos θ).
TEST(SlungLoadPlantTest, CirclesOnACone) {
  const double theta = 0.6;
  const double omega = std::sqrt(1.7 * 9.8 / (1.5 * 1.0 * std::cos(theta)));
  const double share_Q = kVehicle.load_mass / kVehicle.total_mass();
  config::Plant config;
  config.initial.rod.beta = theta;
  config.initial.rod.alpha_dot = -omega * std::tan(theta);  // ṅ = (0, Ω sin θ, 0)
  config.initial.v_WQ = {0.0, -share_Q * omega * std::sin(theta), 0.0};
  SlungLoadPlant plant(kVehicle, config);
  const Eigen::Vector3d p_WC = calc_centre_of_mass(plant.state());
  for (int k = 1; k <= 10'000; ++k) {
    plant.step(calc_hover_force());
    const double angle = omega * k * kStep;
    const Eigen::Vector3d n_W(std::sin(theta) * std::cos(angle), std::sin(theta) * std::sin(angle),
                              std::cos(theta));
    // Phase error (Ωh)⁴/120 ≈ 1.5e-12 per radian, 37 radians.
    ASSERT_LE((plant.state().p_WQ - p_WC + share_Q * n_W).norm(), 1e-9) << "step " << k;
    ASSERT_LE((plant.state().p_WL - p_WC - (1.0 - share_Q) * n_W).norm(), 1e-9) << "step " << k;
  }
}

// --- invariants --------------------------------------------------------------------------------

TEST(SlungLoadPlantTest, KeepsEnergyLessTheHeldForcesWorkAndHorizontalMomentum) {
  SlungLoadPlant plant(kVehicle, make_swinging_plant());
  const Eigen::Vector3d f_Q_W = calc_hover_force();
  const auto calc_invariant = [&] {
    return model::calc_energy(plant.state(), kVehicle) - f_Q_W.dot(plant.state().p_WQ);
  };
  const double energy = calc_invariant();
  const Eigen::Vector3d momentum = model::calc_momentum(plant.state(), kVehicle);
  fly(plant, f_Q_W, 16'000);
  // Runge-Kutta changes the energy by (ωh)⁶/72 ≈ 2e-17 of 1 J per step; 16,000 roundings of 15 J
  // are larger. The truncation error of the swing does not affect the momentum.
  EXPECT_NEAR(calc_invariant(), energy, 1e-11);
  EXPECT_LE((model::calc_momentum(plant.state(), kVehicle) - momentum).norm(), 1e-11);
}

TEST(SlungLoadPlantTest, KeepsTheRodsLengthToRounding) {
  SlungLoadPlant plant(kVehicle, make_swinging_plant());
  double length_error = 0.0, stretch_rate = 0.0;
  for (int k = 0; k < 32'000; ++k) {
    plant.step(calc_hover_force() + Eigen::Vector3d(0.3 * std::sin(3.0 * k * kStep), 0.0, 0.0));
    length_error = std::max(length_error, model::calc_rod_length_error(plant.state(), 1.0));
    stretch_rate = std::max(stretch_rate, model::calc_rod_stretch_rate(plant.state()));
  }
  // The joint cannot stretch. Tolerance: half an ulp of each of two positions below 32 m, and
  // rounding of velocities below 10 m/s.
  EXPECT_LE(length_error, 4e-15);
  EXPECT_LE(stretch_rate, 1e-14);
}

TEST(SlungLoadPlantTest, ConvergesWithTheFourthOrderOfItsStep) {
  const auto fly_with_step = [](std::int64_t step_ns) {
    config::Plant config = make_swinging_plant();
    config.air = {0.3, {1.0, -0.5, 0.2}};
    config.step_ns = step_ns;
    SlungLoadPlant plant(kVehicle, config);
    fly(plant, calc_hover_force() + Eigen::Vector3d(0.5, 0.3, -0.4),
        static_cast<int>(2'048'000'000 / step_ns));
    return plant.state();
  };
  const model::SlungLoadState coarse = fly_with_step(16'000'000);
  const model::SlungLoadState middle = fly_with_step(8'000'000);
  const model::SlungLoadState fine = fly_with_step(4'000'000);
  const double order =
      std::log2((coarse.p_WL - middle.p_WL).norm() / (middle.p_WL - fine.p_WL).norm());
  // The next order of the error is about ωh = 0.05 times the first.
  EXPECT_NEAR(order, 4.0, 0.2);
}

// --- independent equations ---------------------------------------------------------------------

TEST(SlungLoadPlantTest, FollowsTheClosedFormEquationsForThirtyTwoSeconds) {
  SlungLoadPlant plant(kVehicle, make_swinging_plant());
  oracle::State expected = oracle::from_model_state(plant.state());
  double position_error = 0.0, velocity_error = 0.0, angle_error = 0.0, tilt = 0.0;
  for (int k = 0; k < 32'000; ++k) {
    // The feedback uses only the oracle's state: for the plant, the forces are a fixed sequence.
    const Eigen::Vector3d f_Q_W = calc_shaking_force(k * kStep, expected.p_WQ, expected.v_WQ,
                                                     kVehicle.total_mass(), kVehicle.gravity);
    plant.step(f_Q_W);
    expected = fly_oracle(expected, f_Q_W, kVehicle);
    const model::SlungLoadState state = plant.state();
    const model::SlungLoadState now = oracle::to_model_state(expected, kVehicle.rod_length);
    position_error = std::max(position_error, calc_position_difference(state, now));
    velocity_error = std::max(velocity_error, calc_velocity_difference(state, now));
    angle_error = std::max({angle_error, std::abs(state.rod.alpha - now.rod.alpha),
                            std::abs(state.rod.beta - now.rod.beta)});
    tilt = std::max(tilt, calc_tilt(expected.n_W));
  }
  EXPECT_GT(tilt, 20.0 * M_PI / 180.0);
  EXPECT_LT(tilt, 70.0 * M_PI / 180.0);
  // The plant's truncation error is (ωh)⁴/120 = 1e-12 per radian, for 100 radians, and a third more
  // for the higher harmonics of swing and shaking. Rounding is a hundred times smaller: the errors
  // are the same on every machine, 1.38e-10, 2.35e-10, 8.8e-11.
  EXPECT_LE(position_error, 1.4e-10);
  EXPECT_LE(velocity_error, 2.4e-10);
  EXPECT_LE(angle_error, 9e-11);
}

TEST(SlungLoadPlantTest, FollowsTheClosedFormEquationsFarAboveTheHorizontal) {
  config::Plant config;
  config.initial.rod = {0.3, 1.2, 0.5, 9.0};  // above 7 rad/s the load passes over the top
  SlungLoadPlant plant(kVehicle, config);
  oracle::State expected = oracle::from_model_state(plant.state());
  double error = 0.0, largest_beta = 0.0, highest = 1.0;
  for (int k = 0; k < 8000; ++k) {
    plant.step(calc_hover_force());
    expected = fly_oracle(expected, calc_hover_force(), kVehicle);
    error = std::max(
        error, calc_position_difference(plant.state(), oracle::to_model_state(expected, 1.0)));
    largest_beta = std::max(largest_beta, std::abs(plant.state().rod.beta));
    highest = std::min(highest, expected.n_W.z());
  }
  EXPECT_GT(largest_beta, 1.2);
  EXPECT_LT(highest, -0.9);  // the load was far above the quadrotor
  // (ωh)⁴/120 with ω up to 12 rad/s is 2e-10 per radian, 80 radians.
  EXPECT_LE(error, 1e-7);
}

// --- air ---------------------------------------------------------------------------------------

TEST(SlungLoadPlantTest, FollowsTheClosedFormEquationsWithDragAndDisturbance) {
  config::Plant config = make_swinging_plant();
  config.air = {0.35, {2.0, -1.0, 0.5}};
  config.disturbance_W = {0.2, 0.1, -0.3};
  SlungLoadPlant plant(kVehicle, config);
  oracle::State expected = oracle::from_model_state(plant.state());
  double position_error = 0.0;
  for (int k = 0; k < 16'000; ++k) {
    const Eigen::Vector3d f_Q_W = calc_shaking_force(k * kStep, expected.p_WQ, expected.v_WQ,
                                                     kVehicle.total_mass(), kVehicle.gravity);
    plant.step(f_Q_W);
    const auto calc_total = [&](double, const oracle::State& at) -> Eigen::Vector3d {
      const Eigen::Vector3d thrust_axis = f_Q_W.normalized();
      const Eigen::Matrix3d across =
          Eigen::Matrix3d::Identity() - thrust_axis * thrust_axis.transpose();
      const Eigen::Vector3d v_rel = at.v_WQ - Eigen::Vector3d(2.0, -1.0, 0.5);
      return f_Q_W - 0.35 * across * v_rel + Eigen::Vector3d(0.2, 0.1, -0.3);
    };
    for (int i = 0; i < kOracleSubsteps; ++i) {
      expected = oracle::rk4_step_with(expected, calc_total, kStep / kOracleSubsteps, kVehicle);
    }
    position_error =
        std::max(position_error,
                 calc_position_difference(plant.state(), oracle::to_model_state(expected, 1.0)));
  }
  // Half the error of the flight without drag, in half the time.
  EXPECT_LE(position_error, 0.7e-10);
}

// --- determinism and faults --------------------------------------------------------------------

TEST(SlungLoadPlantTest, RefusesAForceThatIsNotFiniteByName) {
  SlungLoadPlant plant(kVehicle, make_swinging_plant());
  fly(plant, calc_hover_force(), 11);
  const model::SlungLoadState before = plant.state();
  const double nan = std::nan(""), infinity = std::numeric_limits<double>::infinity();
  EXPECT_EQ(get_error(plant, {nan, 0.0, 0.0}),
            "force_x_n is not finite after step 11 of the plant");
  EXPECT_EQ(get_error(plant, {0.0, infinity, 0.0}),
            "force_y_n is not finite after step 11 of the plant");
  EXPECT_EQ(get_error(plant, {0.0, 0.0, nan}),
            "force_z_n is not finite after step 11 of the plant");
  EXPECT_EQ(calc_position_difference(plant.state(), before), 0.0);
}

TEST(SlungLoadPlantTest, NamesTheOverflowingValueAndKeepsTheLastFiniteState) {
  for (const double force : {1e160, 1e300, 1e308}) {
    SlungLoadPlant plant(kVehicle, make_swinging_plant());
    std::string error = "no error";
    for (int k = 0; k < 100 && error == "no error"; ++k)
      error = get_error(plant, {force, force, 0.0});
    EXPECT_NE(error.find(" is not finite after step "), std::string::npos) << error;
    EXPECT_TRUE(model::is_finite(plant.state()));
  }
}

TEST(SlungLoadPlantTest, FailsByNameWhereTheLevelRodHasNoAlphaRate) {
  // At z = 0 the load is 1e-15 m below the quadrotor and α̇ is 0. At z = 1000 m rounding removes
  // this difference: cos β = 0 and α̇ = 0/0.
  config::Plant config;
  config.initial.placed = config::Body::kQuadrotor;
  config.initial.rod.beta = M_PI / 2 - 1e-15;
  config.initial.v_WQ = {0.0, 0.0, 1e6};
  SlungLoadPlant plant(kVehicle, config);
  EXPECT_EQ(get_error(plant, Eigen::Vector3d::Zero()),
            "alpha_dot_rad_s is not finite after step 1 of the plant");
  EXPECT_TRUE(model::is_finite(plant.state()));
  EXPECT_EQ(plant.state().p_WQ.z(), 0.0);

  config.initial.position = {0.0, 0.0, 1000.0};
  EXPECT_THROW(SlungLoadPlant(kVehicle, config), std::runtime_error);
}

}  // namespace
}  // namespace sls::sim
