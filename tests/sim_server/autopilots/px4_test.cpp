// The whole autopilot `px4` on the test's own rigid body.
#include <gtest/gtest.h>

#include "sim_server/autopilots/px4/keys.hpp"
#include "tests/sim_server/autopilots/airframes.hpp"
#include "tests/support/errors.hpp"

namespace sls::sim::px4 {
namespace {

using namespace sim::test;  // NOLINT: the tests' own folder

/// The published vehicle; its rotors follow with their published lags.
class Px4Test : public testing::Test {
 protected:
  AutopilotSetup make_setup_with(const Keys& keys) const {
    AutopilotSetup setup = make_setup(airframe_);
    setup.autopilot.model.name = "px4";
    setup.autopilot.own.edit<Keys>() = keys;
    return setup;
  }

  /// Turns the body for a period; the rotors start with `speeds_`.
  void fly_period(Autopilot& autopilot, const Vector3d& f_Q_W) {
    const VectorXd wanted =
        autopilot.step({f_Q_W, Vector3d::Zero(), turning_.attitude()}).rotor_speeds;
    constexpr int kSteps = 8;
    constexpr double kStep = 0.004 / kSteps;
    for (int n = 0; n < kSteps; ++n) {
      for (Eigen::Index i = 0; i < wanted.size(); ++i) {
        const double lag = wanted[i] > speeds_[i] ? 0.0125 : 0.025;
        speeds_[i] = wanted[i] + (speeds_[i] - wanted[i]) * std::exp(-kStep / lag);
      }
      turning_ = turn(turning_, airframe_.inertia_C_B, kStep,
                      [&](const Turning&) { return calc_torque(airframe_, speeds_); });
    }
  }

  /// Time at which the tilt has reached 63 % of that of `f_Q_W`, from rest and level.
  double calc_rise_time(const Vector3d& f_Q_W) {
    Keys keys;
    keys.thrust_map = ThrustMap::kExact;
    const auto autopilot = make_autopilot(make_setup_with(keys));
    turning_ = {};
    for (int n = 0; n < 250; ++n) {
      if (turning_.R.col(2).head<2>().norm() > std::sin(0.632 * 0.2)) return 0.004 * n;
      fly_period(*autopilot, f_Q_W);
    }
    return 1.0;
  }

  const Airframe airframe_ = make_published_airframe();
  Turning turning_;
  VectorXd speeds_ = VectorXd::Constant(4, std::sqrt(16.67 / 4 / 5e-6));
};

TEST_F(Px4Test, ReachesSixtyThreePercentOfAStepInThePublishedTime) {
  const double up = -16.67 * std::cos(0.2), aside = 16.67 * std::sin(0.2);
  // 0.17 s is from the published log; the tolerance is the rotors' lag and the period.
  EXPECT_NEAR(calc_rise_time({0, aside, up}), 0.17, 0.02);
  EXPECT_NEAR(calc_rise_time({0, -aside, up}), 0.17, 0.02);
  EXPECT_NEAR(calc_rise_time({aside, 0, up}), 0.17, 0.02);
}

TEST_F(Px4Test, ComesBackFromAnyAttitudeAndHoldsTheForceItIsAskedFor) {
  std::mt19937_64 random(31);
  const Vector3d f_Q_W(2.0, -3.0, -15.0);
  Keys keys;
  keys.thrust_map = ThrustMap::kExact;
  for (int trial = 0; trial < 20; ++trial) {
    const auto autopilot = make_autopilot(make_setup_with(keys));
    turning_.R = make_random_attitude(random).toRotationMatrix();
    turning_.w = 3.0 * make_random_vector(random);
    for (int n = 0; n < 5000; ++n) fly_period(*autopilot, f_Q_W);
    // The integrators decay with 1.3 s: 1e-6 of the force remain.
    const Vector3d force = -calc_lift(airframe_, speeds_) * turning_.R.col(2);
    EXPECT_NEAR((force - f_Q_W).norm(), 0.0, 2e-5) << trial;
  }
}

TEST_F(Px4Test, IsAPureFunctionOfItsSteps) {
  const auto one = make_autopilot(make_setup_with({})), two = make_autopilot(make_setup_with({}));
  std::mt19937_64 random(32);
  for (int n = 0; n < 1000; ++n) {
    AutopilotInput input;
    input.f_Q_W = 15.0 * make_random_vector(random);
    input.v_WQ.setZero();
    input.attitude = {make_random_attitude(random), 4.0 * make_random_vector(random)};
    const AutopilotOutput first = one->step(input);
    ASSERT_TRUE(is_same(first, two->step(input))) << n;
    ASSERT_TRUE(first.rotor_speeds.allFinite());
    ASSERT_GE(first.rotor_speeds.minCoeff(), 100.0);
    ASSERT_LE(first.rotor_speeds.maxCoeff(), 1100.0);
  }
}

TEST_F(Px4Test, KeepsTheAttitudeWantedBeforeWhereNoForceIsAskedFor) {
  const auto autopilot = make_autopilot(make_setup_with({}));
  AutopilotInput input{{5.0, 0.0, -10.0}, Vector3d::Zero(), {}};
  const Quaterniond wanted = autopilot->step(input).q_WB;
  input.f_Q_W.setZero();
  const AutopilotOutput& output = autopilot->step(input);
  EXPECT_EQ(output.q_WB.coeffs(), wanted.coeffs());
  EXPECT_EQ(output.thrust, 0.0);
  EXPECT_TRUE(output.rotor_speeds.allFinite());
}

TEST_F(Px4Test, RefusesAMixerForAnotherNumberOfRotors) {
  Keys keys;
  keys.mixer = std::vector<MixerRow>(3);
  AutopilotSetup setup = make_setup_with(keys);
  setup.autopilot.model.place = "file:9";
  EXPECT_EQ(sls::test::find_error<config::ConfigError>([&] { make_autopilot(setup); }),
            "file:9: autopilot.mixer: expected a row for each of the 4 rotors, got 3");
}

}  // namespace
}  // namespace sls::sim::px4
