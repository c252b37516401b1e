#include <gtest/gtest.h>

#include "tests/sim_server/autopilots/support.hpp"

namespace sls::sim {
namespace {

using Eigen::Vector3d;

constexpr double kTolerance = 1e-12;

TEST(NoneTest, TheForceActsAtOnceAndEveryRotorGivesAnEqualShareOfIt) {
  const AutopilotSetup setup = make_setup("none");
  const auto autopilot = make_autopilot(setup);
  // Forces of whole length (3-4-12-13, 1-2-2-3), up, level and down.
  for (const auto& [force, thrust] : std::vector<std::pair<Vector3d, double>>{{{3, 4, -12}, 13},
                                                                              {{-1, 2, -2}, 3},
                                                                              {{0, 0, -16}, 16},
                                                                              {{0, 5, 0}, 5},
                                                                              {{0, 0, 2}, 2}}) {
    const AutopilotOutput& output = autopilot->step(make_input(force));
    EXPECT_NEAR(output.thrust, thrust, kTolerance);
    ASSERT_TRUE(output.direction_W);
    EXPECT_LT((output.thrust * *output.direction_W - force).norm(), kTolerance);
    ASSERT_EQ(output.rotor_speeds.size(), 4);
    for (int i = 0; i < 4; ++i) {
      const double speed = output.rotor_speeds[i];
      EXPECT_NEAR(setup.airframe.rotors[i].thrust_constant * speed * speed, thrust / 4, kTolerance);
    }
  }
}

TEST(NoneTest, TheAttitudeSetPointHasTheThrustAlongTheForceAndNoYaw) {
  const auto autopilot = make_autopilot(make_setup("none"));
  for (const Vector3d& force : {Vector3d(3, 4, -12), Vector3d(-1, 2, -2), Vector3d(0, 0, -16)}) {
    const Eigen::Matrix3d R_WB = autopilot->step(make_input(force)).q_WB.toRotationMatrix();
    EXPECT_LT((-R_WB.col(2) - force.normalized()).norm(), kTolerance);
    EXPECT_NEAR(R_WB(1, 0), 0.0, kTolerance);  // x of the body points north or south
    EXPECT_GT(R_WB(0, 0), 0.0);
  }
}

TEST(NoneTest, WithoutAForceThereIsNoThrustAndTheDirectionStays) {
  const auto autopilot = make_autopilot(make_setup("none"));
  const auto step = [&](const Vector3d& force) { return autopilot->step(make_input(force)); };
  EXPECT_EQ(step(Vector3d::Zero()).direction_W, Vector3d(0, 0, -1));
  const Vector3d direction = *step({3, 4, -12}).direction_W;
  const AutopilotOutput output = step(Vector3d::Zero());
  EXPECT_EQ(output.thrust, 0.0);
  EXPECT_EQ(output.rotor_speeds, Eigen::VectorXd::Zero(4));
  EXPECT_EQ(output.direction_W, direction);
}

}  // namespace
}  // namespace sls::sim
