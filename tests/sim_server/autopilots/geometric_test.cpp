// The whole autopilot `geometric` on the test's own rigid body; the rotors are exact and have no
// lag.
#include <gtest/gtest.h>

#include "sim_server/autopilots/geometric/attitude_tracking.hpp"
#include "sim_server/autopilots/geometric/keys.hpp"
#include "tests/sim_server/autopilots/airframes.hpp"

namespace sls::sim::geometric {
namespace {

using namespace sim::test;  // NOLINT: the tests' own folder

AutopilotSetup make_geometric_setup(const Keys& keys = {}) {
  AutopilotSetup setup = make_setup(make_published_airframe());
  setup.autopilot.model.name = "geometric";
  setup.autopilot.own.edit<Keys>() = keys;
  return setup;
}

/// A period of 4 ms with limited rotor speeds.
Turning fly_period(Autopilot& autopilot, const Vector3d& f_Q_W, const Turning& turning) {
  const Airframe airframe = make_published_airframe();
  const VectorXd speeds =
      autopilot.step({f_Q_W, Vector3d::Zero(), turning.attitude()}).rotor_speeds;
  EXPECT_LE(speeds.maxCoeff(), 1100.0 + 1e-9);
  Turning next = turning;
  for (int n = 0; n < 4; ++n)
    next = turn(next, airframe.inertia_C_B, 0.001,
                [&](const Turning&) { return calc_torque(airframe, speeds); });
  return next;
}

TEST(GeometricTest, ComesBackFromAnyAttitudeAndGivesTheForceThatIsAskedFor) {
  std::mt19937_64 random(61);
  const Vector3d f_Q_W(2.0, -3.0, -15.0);
  const Airframe airframe = make_published_airframe();
  for (int trial = 0; trial < 50; ++trial) {
    const auto autopilot = make_autopilot(make_geometric_setup());
    Turning turning{make_random_attitude(random).toRotationMatrix(),
                    3.0 * make_random_vector(random)};
    for (int n = 0; n < 2000; ++n) turning = fly_period(*autopilot, f_Q_W, turning);
    const AutopilotOutput output = autopilot->step({f_Q_W, Vector3d::Zero(), turning.attitude()});
    const Vector3d force = -calc_lift(airframe, output.rotor_speeds) * turning.R.col(2);
    EXPECT_NEAR((force - f_Q_W).norm(), 0.0, 1e-6) << trial;
  }
}

TEST(GeometricTest, ThrustIsThePartOfTheForceAlongTheBody) {
  const auto autopilot = make_autopilot(make_geometric_setup());
  AutopilotInput input{{0, 0, -10.0}, Vector3d::Zero(), {}};
  input.attitude.q_WB = Quaterniond(Eigen::AngleAxisd(0.4, Vector3d::UnitX()));
  EXPECT_NEAR(autopilot->step(input).thrust, 10.0 * std::cos(0.4), 1e-12);
  input.attitude.q_WB = Quaterniond(Eigen::AngleAxisd(2.5, Vector3d::UnitX()));
  EXPECT_EQ(autopilot->step(input).thrust, 0.0);
}

TEST(GeometricTest, GainsAreTheScenariosOrFollowFromTheInertia) {
  // With torque only about x, a rate of 0.1 rad/s and no error.
  const auto calc_roll_torque = [](const Keys& keys) {
    const auto autopilot = make_autopilot(make_geometric_setup(keys));
    AutopilotInput input{{0, 0, -12.0}, Vector3d::Zero(), {}};
    input.attitude.w_WB_B = {0.1, 0, 0};
    return calc_torque(make_published_airframe(), autopilot->step(input).rotor_speeds).x();
  };
  Keys keys;
  EXPECT_NEAR(calc_roll_torque(keys), -0.1 * 20.0 * (0.0300 + 0.0295 + 0.0564) / 3, 1e-12);
  keys.rate = 0.25;
  EXPECT_NEAR(calc_roll_torque(keys), -0.025, 1e-12);
}

TEST(GeometricTest, IsAPureFunctionOfItsSteps) {
  const auto one = make_autopilot(make_geometric_setup()),
             two = make_autopilot(make_geometric_setup());
  std::mt19937_64 random(62);
  for (int n = 0; n < 1000; ++n) {
    AutopilotInput input;
    input.f_Q_W = n % 50 == 0 ? Vector3d::Zero().eval() : 15.0 * make_random_vector(random);
    input.v_WQ.setZero();
    input.attitude = {make_random_attitude(random), 4.0 * make_random_vector(random)};
    const AutopilotOutput first = one->step(input);
    ASSERT_TRUE(is_same(first, two->step(input))) << n;
    ASSERT_TRUE(first.rotor_speeds.allFinite());
  }
}

}  // namespace
}  // namespace sls::sim::geometric
