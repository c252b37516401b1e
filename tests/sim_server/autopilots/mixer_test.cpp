// The mixer of `px4`: cases computed by hand, and properties of every case.
#include "sim_server/autopilots/px4/mixer.hpp"

#include <gtest/gtest.h>

#include "tests/sim_server/autopilots/airframes.hpp"
#include "tests/support/errors.hpp"

namespace sls::sim::px4 {
namespace {

using Eigen::Index, Eigen::Vector3d, Eigen::VectorXd;
using sim::test::make_published_airframe, sim::test::make_random_vector, sim::test::make_ring,
    sim::test::make_setup;

/// PX4's "quad x".
const std::vector<MixerRow> kQuadX{{-std::sqrt(0.5), std::sqrt(0.5), 1, 1},
                                   {std::sqrt(0.5), -std::sqrt(0.5), 1, 1},
                                   {std::sqrt(0.5), std::sqrt(0.5), -1, 1},
                                   {-std::sqrt(0.5), -std::sqrt(0.5), -1, 1}};

void expect_outputs(const MixerOutput& mixed, const std::vector<double>& expected) {
  ASSERT_EQ(mixed.outputs.size(), static_cast<Index>(expected.size()));
  for (std::size_t i = 0; i < expected.size(); ++i)
    EXPECT_NEAR(mixed.outputs[static_cast<Index>(i)], expected[i], 1e-12) << i;
}

/// Torques that `outputs` produce; the columns of `kQuadX` are orthogonal.
Vector3d calc_output_torque(const VectorXd& outputs) {
  Vector3d torque = Vector3d::Zero();
  for (std::size_t i = 0; i < kQuadX.size(); ++i) {
    const double output = outputs[static_cast<Index>(i)];
    torque += output * Vector3d(kQuadX[i].roll / 2, kQuadX[i].pitch / 2, kQuadX[i].yaw / 4);
  }
  return torque;
}

TEST(MixerRowsTest, AreThePublishedOnesForThePublishedRotors) {
  const std::vector<MixerRow> rows = make_mixer(make_setup(make_published_airframe()));
  const std::vector<MixerRow> published{
      {-0.438, 0.707, 0.909}, {0.438, -0.707, 1.0}, {0.438, 0.707, -0.909}, {-0.438, -0.707, -1.0}};
  ASSERT_EQ(rows.size(), published.size());
  for (std::size_t i = 0; i < rows.size(); ++i) {
    EXPECT_NEAR(rows[i].roll, published[i].roll, 5e-4);  // three decimals were published
    EXPECT_NEAR(rows[i].pitch, published[i].pitch, 5e-4);
    EXPECT_NEAR(rows[i].yaw, published[i].yaw, 5e-4);
    EXPECT_NEAR(rows[i].thrust, 1.0, 1e-9);
  }
}

TEST(MixerRowsTest, AreThoseOfTheXForASquare) {
  Airframe square = make_published_airframe();
  square.rotors = {sim::test::make_rotor(0.2, 0.2, 1), sim::test::make_rotor(-0.2, -0.2, 1),
                   sim::test::make_rotor(0.2, -0.2, -1), sim::test::make_rotor(-0.2, 0.2, -1)};
  const std::vector<MixerRow> rows = make_mixer(make_setup(square));
  for (std::size_t i = 0; i < rows.size(); ++i) {
    EXPECT_NEAR(rows[i].roll, kQuadX[i].roll, 1e-12);
    EXPECT_NEAR(rows[i].pitch, kQuadX[i].pitch, 1e-12);
    EXPECT_NEAR(rows[i].yaw, kQuadX[i].yaw, 1e-12);
    EXPECT_NEAR(rows[i].thrust, 1.0, 1e-12);
  }
}

TEST(MixerRowsTest, EachDemandMakesItsOwnTorqueOrThrustAlone) {
  for (const Airframe& airframe : {make_published_airframe(), make_ring(6), make_ring(8)}) {
    const std::vector<MixerRow> rows = make_mixer(make_setup(airframe));
    for (int demand = 0; demand < 4; ++demand) {
      Vector3d torque = Vector3d::Zero();
      double lift = 0.0;
      for (std::size_t i = 0; i < rows.size(); ++i) {
        const double shares[] = {rows[i].roll, rows[i].pitch, rows[i].yaw, rows[i].thrust};
        const Rotor& rotor = airframe.rotors[i];
        const double thrust = rotor.thrust_constant * shares[demand];
        torque += rotor.p_BR.cross(Vector3d(0, 0, -thrust));
        torque.z() += rotor.spin * rotor.torque_constant * thrust;
        lift += thrust;
      }
      for (int axis = 0; axis < 3; ++axis)
        if (axis == demand)
          EXPECT_GT(torque[axis], 1e-7);
        else
          EXPECT_NEAR(torque[axis], 0.0, 1e-18);
      if (demand == 3)
        EXPECT_GT(lift, 1e-6);
      else
        EXPECT_NEAR(lift, 0.0, 1e-18);
    }
  }
}

TEST(MixerRowsTest, LeaveYawOutWithoutAuthority) {
  Airframe airframe = make_published_airframe();
  for (const double spin : {0.0, 1.0}) {
    for (Rotor& rotor : airframe.rotors) {
      rotor.spin = 1.0;
      rotor.torque_constant = 0.05 * spin;
    }
    airframe.rotors[0].p_BR = {0.13, 0.20, 0.0};
    airframe.rotors[2].p_BR = {0.13, -0.20, 0.0};
    for (const MixerRow& row : make_mixer(make_setup(airframe))) {
      EXPECT_EQ(row.yaw, 0.0);
      EXPECT_NEAR(std::abs(row.pitch), std::sqrt(0.5), 1e-9);
      EXPECT_NEAR(row.thrust, 1.0, 1e-9);
    }
  }
}

TEST(MixerRowsTest, RotorsInALineAreRefused) {
  Airframe airframe = make_published_airframe();
  for (Rotor& rotor : airframe.rotors) rotor.p_BR.x() = 0.0;
  AutopilotSetup setup = make_setup(airframe);
  setup.autopilot.model.place = "file:7";
  EXPECT_EQ(
      sls::test::find_error<config::ConfigError>([&] { make_mixer(setup); }),
      "file:7: plant.rotors: expected rotors that roll and pitch the body, got 4 that cannot");
}

TEST(MixerTest, AddsUpWhereNothingSaturates) {
  const MixerOutput mixed = mix(kQuadX, {0.1, 0.2, 0.05}, 0.5);
  const double r = std::sqrt(0.5);
  expect_outputs(mixed, {0.5 - 0.1 * r + 0.2 * r + 0.05, 0.5 + 0.1 * r - 0.2 * r + 0.05,
                         0.5 + 0.1 * r + 0.2 * r - 0.05, 0.5 - 0.1 * r - 0.2 * r - 0.05});
  for (int axis = 0; axis < 3; ++axis) {
    EXPECT_FALSE(mixed.saturation.positive[static_cast<std::size_t>(axis)]);
    EXPECT_FALSE(mixed.saturation.negative[static_cast<std::size_t>(axis)]);
  }
}

TEST(MixerTest, GivesThrustUpForRoll) {
  // 0.9 ± 0.5 √½ exceeds 1 by 0.2536: thrust becomes 0.6464 and the roll stays.
  const double roll = 0.5 * std::sqrt(0.5);
  expect_outputs(mix(kQuadX, {0.5, 0, 0}, 0.9), {1 - 2 * roll, 1, 1, 1 - 2 * roll});
}

TEST(MixerTest, DoesNotRaiseThrustForRoll) {
  // 0.1 − 0.5 √½ < 0: the roll is reduced until the thrust of 0.1 suffices.
  const MixerOutput mixed = mix(kQuadX, {0.5, 0, 0}, 0.1);
  expect_outputs(mixed, {0, 0.2, 0.2, 0});
  EXPECT_TRUE(mixed.saturation.positive[0]);
  EXPECT_FALSE(mixed.saturation.negative[0]);
}

TEST(MixerTest, ReportsTheDirectionsThatWouldLowerARotorThatStands) {
  // Only the last rotor is at 0: less roll, pitch or yaw would raise it.
  const Saturation last = mix(kQuadX, {0.2, 0.2, 0}, 0.2).saturation;
  EXPECT_EQ(last.positive, (std::array<bool, 3>{true, true, true}));
  EXPECT_EQ(last.negative, (std::array<bool, 3>{false, false, false}));
  // Only the third rotor is at 0: more roll, more pitch or less yaw would raise it.
  const Saturation third = mix(kQuadX, {-0.2, -0.2, 0}, 0.2).saturation;
  EXPECT_EQ(third.positive, (std::array<bool, 3>{false, false, true}));
  EXPECT_EQ(third.negative, (std::array<bool, 3>{true, true, false}));
}

TEST(MixerTest, GivesYawUpBeforeThrust) {
  // 0.95 + 0.5 exceeds 1.15: yaw is reduced to 0.2. Then thrust is reduced by 0.15.
  expect_outputs(mix(kQuadX, {0, 0, 0.5}, 0.95), {1.0, 1.0, 0.6, 0.6});
}

TEST(MixerTest, GivesYawUpBeforeRoll) {
  // Roll alone brings the rotors to 0 and 1: no yaw is possible.
  expect_outputs(mix(kQuadX, {std::sqrt(0.5), 0, 0.3}, 0.5), {0, 1, 1, 0});
}

TEST(MixerTest, SharesOutExcessDemandAtBothLimits) {
  // 0.5 ± √2 at two rotors. If the roll lost all of this excess, the other two would exceed their
  // limits: half of it is given back, and no roll remains. Then pitch is reduced to √½.
  expect_outputs(mix(kQuadX, {1, 1, 0}, 0.5), {1, 0, 1, 0});
}

TEST(MixerTest, CountsDemandsUpToTheirLimits) {
  EXPECT_EQ(mix(kQuadX, {0, 0, 0}, 3.0).outputs, VectorXd::Ones(4));
  EXPECT_EQ(mix(kQuadX, {0, 0, 0}, -3.0).outputs, VectorXd::Zero(4));
  EXPECT_EQ(mix(kQuadX, {5, -7, 2}, 0.6).outputs, mix(kQuadX, {1, -1, 1}, 0.6).outputs);
}

TEST(MixerTest, KeepsToTheLimitsAndNeverRaisesThrustNorTurnsATorqueRound) {
  std::mt19937_64 random(21);
  std::uniform_real_distribution<double> any(0.0, 1.0);
  for (int n = 0; n < 20'000; ++n) {
    const Vector3d wanted = make_random_vector(random);
    const double thrust = any(random);
    const VectorXd outputs = mix(kQuadX, wanted, thrust).outputs;
    ASSERT_GE(outputs.minCoeff(), 0.0);
    ASSERT_LE(outputs.maxCoeff(), 1.0);
    ASSERT_LE(outputs.sum(), 4.0 * thrust + 0.3);  // the clamp at 0 after yaw (0.15) adds
    // Without yaw no output is clamped: roll and pitch are only reduced.
    const VectorXd level = mix(kQuadX, {wanted.x(), wanted.y(), 0.0}, thrust).outputs;
    ASSERT_LE(level.sum(), 4.0 * thrust + 1e-12);
    const Vector3d torque = calc_output_torque(level);
    ASSERT_NEAR(torque.z(), 0.0, 1e-12);
    for (int axis = 0; axis < 2; ++axis) {
      ASSERT_GE(torque[axis] * wanted[axis], -1e-12);
      ASSERT_LE(std::abs(torque[axis]), std::abs(wanted[axis]) + 1e-12);
    }
  }
}

TEST(MixerTest, WhereThereIsRoomTheSumIsTheThrustAndTheTorqueTheWantedOne) {
  std::mt19937_64 random(22);
  for (int n = 0; n < 1000; ++n) {
    const Vector3d wanted = 0.15 * make_random_vector(random);
    const VectorXd outputs = mix(kQuadX, wanted, 0.5).outputs;
    ASSERT_NEAR(outputs.sum(), 2.0, 1e-12);
    ASSERT_NEAR((calc_output_torque(outputs) - wanted).norm(), 0.0, 1e-12);
  }
}

}  // namespace
}  // namespace sls::sim::px4
