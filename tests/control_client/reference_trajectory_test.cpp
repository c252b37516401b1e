#include "control_client/reference_trajectory.hpp"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <functional>

namespace sls::control {
namespace {

using Eigen::Vector3d;

constexpr double kPi = 3.14159265358979323846;

/// Derivative of `function` at `t` by central differences of eighth order with step `h`.
Vector3d differentiate(const std::function<Vector3d(double)>& function, double t, double h) {
  return (4.0 / 5.0 * (function(t + h) - function(t - h)) -
          1.0 / 5.0 * (function(t + 2 * h) - function(t - 2 * h)) +
          4.0 / 105.0 * (function(t + 3 * h) - function(t - 3 * h)) -
          1.0 / 280.0 * (function(t + 4 * h) - function(t - 4 * h))) /
         h;
}

/// Every derivative that `trajectory` returns is the derivative of the one below it.
void expect_consistent_derivatives(const ReferenceTrajectory& trajectory, double t, double h,
                                   double tolerance) {
  using Member = Vector3d model::Reference::*;
  const Member chain[] = {&model::Reference::position, &model::Reference::velocity,
                          &model::Reference::acceleration, &model::Reference::jerk,
                          &model::Reference::snap};
  for (int order = 0; order < 4; ++order) {
    const Vector3d numerical =
        differentiate([&](double at) { return trajectory.calc(at).*chain[order]; }, t, h);
    EXPECT_LE((numerical - trajectory.calc(t).*chain[order + 1]).norm(), tolerance)
        << "derivative " << order + 1 << " at " << t << " s";
  }
}

config::FigureEightReference make_eight() {
  config::FigureEightReference eight;
  eight.amplitude << 1.5, 0.75, 0.5;
  eight.offset << 0.1, -0.2, -0.5;
  eight.period_s = 16.0;
  return eight;
}

config::RestToRestReference make_rest_to_rest() {
  return {Vector3d(1.0, -1.0, -2.0), Vector3d(-2.0, 0.5, -4.0), 3.0};
}

void expect_at_rest(const model::Reference& reference, const Vector3d& position) {
  EXPECT_EQ(reference.position, position);
  EXPECT_EQ(reference.velocity, Vector3d::Zero());
  EXPECT_EQ(reference.acceleration, Vector3d::Zero());
  EXPECT_EQ(reference.jerk, Vector3d::Zero());
  EXPECT_EQ(reference.snap, Vector3d::Zero());
}

TEST(ReferenceTrajectoryTest, ConstantRests) {
  const auto trajectory = make_reference_trajectory(config::ConstantReference{{1.0, -1.0, -2.0}});
  for (const double t : {0.0, 0.004, 1e6}) {
    expect_at_rest(trajectory->calc(t), Vector3d(1.0, -1.0, -2.0));
  }
}

TEST(ReferenceTrajectoryTest, FigureEightFollowsTheLiteralFormula) {
  config::FigureEightReference config = make_eight();
  config.offset << 0.0, 0.0, -0.5;
  const auto trajectory = make_reference_trajectory(config);
  for (double t = 0.0; t < 40.0; t += 0.037) {
    const double T = 16.0;
    const Vector3d expected(1.5 * std::sin(2 * kPi * t / T), 0.75 * std::sin(4 * kPi * t / T),
                            -0.5 + 0.5 * std::sin(2 * kPi * t / T));
    // The argument's rounding: up to 31 rad · 2⁻⁵³ · a few.
    EXPECT_LE((trajectory->calc(t).position - expected).norm(), 3e-14);
  }
  EXPECT_EQ(trajectory->calc(0.0).position, Vector3d(0.0, 0.0, -0.5));
}

TEST(ReferenceTrajectoryTest, FigureEightHasExactDerivatives) {
  const FigureEight trajectory(make_eight());
  // h = 0.05 s: truncation (ω h)⁸ / 630 = 1e-13 of the amplitude, rounding eps / h = 1e-14.
  for (double t = 0.3; t < 20.0; t += 0.71)
    expect_consistent_derivatives(trajectory, t, 0.05, 1e-12);
}

TEST(ReferenceTrajectoryTest, FigureEightRepeatsAfterItsPeriod) {
  const FigureEight trajectory(make_eight());
  for (double t = 0.0; t < 16.0; t += 0.5) {
    EXPECT_LE((trajectory.calc(t).position - trajectory.calc(t + 16.0).position).norm(), 1e-14);
    EXPECT_LE((trajectory.calc(t).snap - trajectory.calc(t + 16.0).snap).norm(), 1e-14);
  }
}

TEST(ReferenceTrajectoryTest, RestToRestRestsAtBothEndsAndOutside) {
  const config::RestToRestReference config = make_rest_to_rest();
  const auto trajectory = make_reference_trajectory(config);
  for (const double t : {-1.0, 0.0}) expect_at_rest(trajectory->calc(t), config.from);
  for (const double t : {3.0, 3.004, 100.0}) expect_at_rest(trajectory->calc(t), config.to);
}

TEST(ReferenceTrajectoryTest, RestToRestHasExactDerivatives) {
  const RestToRest trajectory(make_rest_to_rest());
  // Rounding of a jerk of some 50 m/s³ at h = 0.01 s: 1e-12. Truncation of the eighth-order formula
  // for a polynomial of degree 9: h⁸ / 630 of the ninth derivative, 1e-14.
  for (double t = 0.06; t < 2.95; t += 0.05)
    expect_consistent_derivatives(trajectory, t, 0.01, 5e-11);
}

TEST(ReferenceTrajectoryTest, RestToRestIsTheNinthDegreePolynomialAndSmoothAtItsEnds) {
  // Solves the ten end conditions for the polynomial of degree 9: position 0 and 1, and velocity,
  // acceleration, jerk and snap zero at both ends.
  Eigen::Matrix<double, 10, 10> conditions = Eigen::Matrix<double, 10, 10>::Zero();
  Eigen::Matrix<double, 10, 1> values = Eigen::Matrix<double, 10, 1>::Zero();
  for (int order = 0; order < 5; ++order) {
    for (int power = order; power < 10; ++power) {
      double factor = 1.0;
      for (int k = 0; k < order; ++k) factor *= power - k;
      if (power == order) conditions(order, power) = factor;  // at τ = 0
      conditions(5 + order, power) = factor;                  // at τ = 1
    }
  }
  values[5] = 1.0;
  const Eigen::Matrix<double, 10, 1> polynomial = conditions.fullPivLu().solve(values);
  const config::RestToRestReference config = make_rest_to_rest();
  const RestToRest trajectory(config);
  for (double tau = 0.0; tau <= 1.0; tau += 0.01) {
    double blend = 0.0;
    for (int power = 9; power >= 0; --power) blend = blend * tau + polynomial[power];
    const Vector3d expected = config.from + blend * (config.to - config.from);
    // The system is ill-conditioned (1e6), and its coefficients are up to 540.
    EXPECT_LE((trajectory.calc(3.0 * tau).position - expected).norm(), 1e-9);
  }
  // No derivative jumps at the ends: the snap grows there like 15120 τ · 3.6 m / (3 s)⁴.
  EXPECT_LE(trajectory.calc(1e-9).snap.norm(), 1e-6);
  EXPECT_LE(trajectory.calc(3.0 - 1e-9).snap.norm(), 1e-6);
}

TEST(ReferenceTrajectoryTest, RestToRestIsSymmetricAboutItsMiddle) {
  const config::RestToRestReference config = make_rest_to_rest();
  const RestToRest trajectory(config);
  for (double t = 0.0; t < 1.5; t += 0.01) {
    const Vector3d sum = trajectory.calc(t).position + trajectory.calc(3.0 - t).position;
    EXPECT_LE((sum - config.from - config.to).norm(), 1e-13);
  }
}

// --- attitude of a shared load -------------------------------------------------------------------

Eigen::Quaterniond to_quaternion(double roll, double pitch, double yaw) {
  return Eigen::AngleAxisd(yaw, Vector3d::UnitZ()) * Eigen::AngleAxisd(pitch, Vector3d::UnitY()) *
         Eigen::AngleAxisd(roll, Vector3d::UnitX());
}

config::RestToRestReference make_turn() {
  config::RestToRestReference turn = make_rest_to_rest();
  turn.from_attitude = Vector3d(0.3, -0.2, 3.0);
  turn.to_attitude = Vector3d(-0.1, 0.4, -2.5);
  return turn;
}

TEST(AttitudeTrajectoryTest, TurnsFromTheFirstAttitudeToTheSecondByTheShorterWay) {
  const AttitudeTrajectory turn(make_turn(), Eigen::Quaterniond::Identity());
  const Eigen::Quaterniond from = to_quaternion(0.3, -0.2, 3.0),
                           to = to_quaternion(-0.1, 0.4, -2.5);
  EXPECT_TRUE(turn.turns());
  for (const double before : {-1.0, 0.0})
    EXPECT_LE((turn.calc(before).R_WL - from.toRotationMatrix()).norm(), 1e-15 * 10.0);
  for (const double after : {3.0, 4.0}) {
    EXPECT_LE((turn.calc(after).R_WL - to.toRotationMatrix()).norm(), 1e-15 * 10.0);
    EXPECT_EQ(turn.calc(after).turn, Eigen::Vector4d::Zero());
  }
  // Half-way in time is half-way in the turn.
  EXPECT_LE((turn.calc(1.5).R_WL - from.slerp(0.5, to).toRotationMatrix()).norm(), 1e-14);
}

TEST(AttitudeTrajectoryTest, AStageWithoutAnAttitudeHoldsThatOfStepZero) {
  const Eigen::Quaterniond start = to_quaternion(0.1, 0.2, 0.3);
  const AttitudeTrajectory rest(config::RestToRestReference(make_rest_to_rest()), start),
      eight(make_eight(), start), hold(config::ConstantReference{}, start);
  for (const AttitudeTrajectory* trajectory : {&rest, &eight, &hold}) {
    EXPECT_FALSE(trajectory->turns());
    EXPECT_EQ(trajectory->calc(1.0).R_WL, start.toRotationMatrix());
    EXPECT_EQ(trajectory->calc(1.0).turn, Eigen::Vector4d::Zero());
  }
  config::FigureEightReference turned = make_eight();
  turned.attitude = Vector3d(0.0, 0.0, 1.0);
  EXPECT_LE((AttitudeTrajectory(turned, start).calc(1.0).R_WL -
             to_quaternion(0.0, 0.0, 1.0).toRotationMatrix())
                .norm(),
            1e-15 * 10.0);
}

TEST(AttitudeTrajectoryTest, TheEndOfACableMovesWithExactDerivatives) {
  struct End : ReferenceTrajectory {
    RestToRest centre{make_turn()};
    AttitudeTrajectory attitude{make_turn(), Eigen::Quaterniond::Identity()};
    model::Reference calc(double time) const override {
      return calc_end_reference(centre.calc(time), attitude.calc(time), Vector3d(0.4, -0.3, 0.2));
    }
  };
  for (const double t : {0.4, 1.1, 2.3}) expect_consistent_derivatives(End(), t, 0.01, 1e-9);
}

}  // namespace
}  // namespace sls::control
