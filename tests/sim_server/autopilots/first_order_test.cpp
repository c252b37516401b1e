#include <gtest/gtest.h>

#include <cmath>

#include "sim_server/autopilots/first_order/keys.hpp"
#include "tests/sim_server/autopilots/support.hpp"

namespace sls::sim {
namespace {

using Eigen::Vector3d;

constexpr double kRounding = 1e-12;
constexpr double kThrust = 16.0;                 // N
constexpr double kPeriod = 0.004, kLag = 0.154;  // s

std::unique_ptr<Autopilot> make_lagging(double lag_s) {
  return make_autopilot(make_setup("first_order", FirstOrderKeys{lag_s}));
}

/// Force of kThrust N, tilted by `tilt` rad from straight up towards `heading` rad.
Vector3d make_force(double tilt, double heading = 0.0) {
  return kThrust * Vector3d(std::sin(tilt) * std::cos(heading), std::sin(tilt) * std::sin(heading),
                            -std::cos(tilt));
}

/// Angle of `direction` from straight up, in the plane of x and z, rad.
double calc_tilt(const Vector3d& direction) { return std::atan2(direction.x(), -direction.z()); }

TEST(FirstOrderTest, AStepOfTheDirectionDecaysExponentially) {
  const auto autopilot = make_lagging(kLag);
  // Normalising changes an angle θ by less than θ³: for 1e-5 rad, less than the rounding.
  constexpr double kTilt = 1e-5;
  for (int k = 1; k <= 500; ++k) {
    const AutopilotOutput& output = autopilot->step(make_input(make_force(kTilt)));
    const double expected = kTilt * (1.0 - std::exp(-k * kPeriod / kLag));
    ASSERT_NEAR(calc_tilt(*output.direction_W), expected, kRounding) << k;
  }
}

TEST(FirstOrderTest, TurnsInAPlaneByTheAngleOfTheNormalisedSum) {
  // The remaining angle θ between directions of length 1, by plane trigonometry:
  // tan θ' = κ sin θ / (1 − κ + κ cos θ).
  const double kept = std::exp(-kPeriod / kLag), heading = 0.7, tilt = 2.5;
  const auto autopilot = make_lagging(kLag);
  const Vector3d wanted = make_force(tilt, heading) / kThrust;
  double left = tilt;
  for (int k = 1; k <= 500; ++k) {
    const Vector3d direction = *autopilot->step(make_input(make_force(tilt, heading))).direction_W;
    left = std::atan2(kept * std::sin(left), 1.0 - kept + kept * std::cos(left));
    ASSERT_LT((direction - make_force(tilt - left, heading) / kThrust).norm(), kRounding) << k;
    ASSERT_NEAR(direction.norm(), 1.0, kRounding) << k;
  }
  EXPECT_LT(left, 1e-4);
  EXPECT_LT((*autopilot->step(make_input(make_force(tilt, heading))).direction_W - wanted).norm(),
            1e-4);
}

TEST(FirstOrderTest, TheThrustDoesNotLagAndEveryRotorGivesAnEqualShare) {
  const AutopilotSetup setup = make_setup("first_order", FirstOrderKeys{kLag});
  const auto autopilot = make_autopilot(setup);
  for (const double thrust : {13.0, 26.0, 0.0}) {
    const AutopilotOutput& output =
        autopilot->step(make_input(thrust / 13.0 * Vector3d(3.0, 4.0, -12.0)));
    EXPECT_NEAR(output.thrust, thrust, kRounding);
    for (int i = 0; i < 4; ++i) {
      const double speed = output.rotor_speeds[i];
      EXPECT_NEAR(setup.airframe.rotors[i].thrust_constant * speed * speed, thrust / 4, kRounding);
    }
  }
}

TEST(FirstOrderTest, WithoutLagItEqualsNone) {
  const auto lagging = make_lagging(0.0), none = make_autopilot(make_setup("none"));
  for (int k = 0; k < 100; ++k) {
    const AutopilotInput input = make_input(make_force(0.03 * k, 0.1 * k));
    const AutopilotOutput& one = lagging->step(input);
    const AutopilotOutput& other = none->step(input);
    ASSERT_LT((*one.direction_W - *other.direction_W).norm(), kRounding);
    ASSERT_EQ(one.rotor_speeds, other.rotor_speeds);
    ASSERT_EQ(one.q_WB.coeffs(), other.q_WB.coeffs());
    ASSERT_EQ(one.thrust, other.thrust);
  }
}

TEST(FirstOrderTest, ADirectionExactlyOppositeIsLeftByNoLagThatIsLongerThanThePeriod) {
  const auto autopilot = make_lagging(kLag);
  for (int k = 0; k < 10; ++k)
    EXPECT_EQ(autopilot->step(make_input({0.0, 0.0, kThrust})).direction_W, Vector3d(0, 0, -1));
  EXPECT_EQ(make_lagging(0.0)->step(make_input({0.0, 0.0, kThrust})).direction_W,
            Vector3d(0, 0, 1));
}

}  // namespace
}  // namespace sls::sim
