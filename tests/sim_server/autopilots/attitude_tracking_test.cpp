// The law of Lee, Leok and McClamroch (2010) on the test's own rigid body: the properties that the
// paper proves.
#include "sim_server/autopilots/geometric/attitude_tracking.hpp"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>

#include "tests/sim_server/autopilots/airframes.hpp"

namespace sls::sim::geometric {
namespace {

using namespace sim::test;  // NOLINT: the tests' own folder

constexpr double kStep = 1e-3;
const Matrix3d kInertia =
    (Matrix3d() << 0.0300, 0.001, 0.0005, 0.001, 0.0295, -0.0007, 0.0005, -0.0007, 0.0564)
        .finished();

/// The bound of the paper's proposition 1 if Ψ never exceeds `psi`. The paper allows a range of c₂;
/// here it is half of the largest allowed value.
struct Bound {
  Bound(const Gains& gains, double psi) : k_R(gains.attitude), psi_2(psi) {
    const Vector3d moments = Eigen::SelfAdjointEigenSolver<Matrix3d>(kInertia).eigenvalues();
    const double least = moments[0], most = moments[2], k_w = gains.rate;
    c_2 =
        0.5 *
        std::min({k_w, 4 * k_w * k_R * least * least / (k_w * k_w * most + 4 * k_R * least * least),
                  std::sqrt(k_R * least), std::sqrt(2 / (2 - psi_2) * k_R * most)});
    Eigen::Matrix2d M_21, M_22, W_2;
    M_21 << k_R, -c_2, -c_2, least;
    M_22 << 2 * k_R / (2 - psi_2), c_2, c_2, most;
    W_2 << c_2 * k_R / most, -c_2 * k_w / (2 * least), -c_2 * k_w / (2 * least), k_w - c_2;
    least_of_M_21 = smallest(M_21) / 2;
    rate = smallest(W_2) / (-smallest(-M_22) / 2);
  }

  double calc_lyapunov(double psi, const Vector3d& e_R, const Vector3d& e_w) const {
    return 0.5 * e_w.dot(kInertia * e_w) + k_R * psi + c_2 * e_R.dot(e_w);
  }

  static double smallest(const Eigen::Matrix2d& matrix) {
    return Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d>(matrix).eigenvalues()[0];
  }

  double k_R, psi_2, c_2, least_of_M_21;
  double rate;  ///< β₂, 1/s
};

/// A turning wanted attitude R_d = exp(a(t)) about a fixed axis, and its derivatives.
WantedRotation make_wanted(double t) {
  const Vector3d axis = Vector3d(1, 2, -0.5).normalized();
  WantedRotation wanted;
  wanted.R_WB = Eigen::AngleAxisd(std::sin(2 * t), axis).toRotationMatrix();
  wanted.w_WB_B = 2 * std::cos(2 * t) * axis;
  wanted.w_dot_WB_B = -4 * std::sin(2 * t) * axis;
  return wanted;
}

Turning turn_towards(const Turning& turning, const Gains& gains, double t, bool tracks) {
  const auto moment_at = [&](double time) {
    return [&gains, time, tracks](const Turning& at) {
      const WantedRotation wanted = tracks ? make_wanted(time) : WantedRotation{};
      return calc_moment({at.R, at.w}, wanted, kInertia, gains);
    };
  };
  return turn(turning, kInertia, kStep, moment_at(t + kStep / 2));
}

TEST(AttitudeTrackingTest, DistanceIsOneMinusTheCosineOfTheAngle) {
  std::mt19937_64 random(41);
  for (int i = 0; i < 100; ++i) {
    const Quaterniond q = make_random_attitude(random);
    const Vector3d axis = make_random_vector(random).normalized();
    const double angle = 0.0314 * i;
    const Matrix3d R = (q * Quaterniond(Eigen::AngleAxisd(angle, axis))).toRotationMatrix();
    EXPECT_NEAR(calc_attitude_distance(R, q.toRotationMatrix()), 1 - std::cos(angle), 1e-12);
    EXPECT_NEAR((calc_attitude_error(R, q.toRotationMatrix()) - std::sin(angle) * axis).norm(), 0.0,
                1e-12);
  }
}

TEST(AttitudeTrackingTest, ErrorDecaysAsTheProofSays) {
  std::mt19937_64 random(42);
  const Gains gains = make_default_gains(kInertia);
  for (const double angle : {30.0, 60.0, 90.0, 150.0, 179.0}) {
    const Vector3d axis = make_random_vector(random).normalized();
    Turning turning;
    turning.R = Eigen::AngleAxisd(angle * kPi / 180, axis).toRotationMatrix();
    // The initial kinetic energy is half of that which the proposition allows.
    const double psi_0 = 1 - std::cos(angle * kPi / 180);
    const double w_most = std::sqrt(2 / kInertia.trace() * gains.attitude * (2 - psi_0));
    turning.w = std::sqrt(0.5) * w_most * make_random_vector(random).normalized();
    const double energy = 0.5 * turning.w.dot(kInertia * turning.w) + gains.attitude * psi_0;
    const Bound bound(gains, energy / gains.attitude);
    ASSERT_LT(bound.psi_2, 2.0);
    ASSERT_GT(bound.rate, 0.0);
    ASSERT_GT(bound.least_of_M_21, 0.0);
    const Matrix3d level = Matrix3d::Identity();
    double first = 0.0;
    for (int n = 0; n < 5000; ++n) {
      const double psi = calc_attitude_distance(turning.R, level);
      const double lyapunov =
          bound.calc_lyapunov(psi, calc_attitude_error(turning.R, level), turning.w);
      if (n == 0) first = lyapunov;
      const double decayed = first * std::exp(-bound.rate * kStep * n);
      constexpr double kRounding = 1e-14;
      ASSERT_LE(lyapunov, decayed + kRounding) << angle << " " << n;
      ASSERT_LE(psi, decayed / bound.least_of_M_21 / (2 - bound.psi_2) + kRounding);
      ASSERT_LT(psi, 2.0);
      turning = turn_towards(turning, gains, 0.0, false);
    }
    EXPECT_LT(calc_attitude_distance(turning.R, level), 1e-10) << angle;
  }
}

TEST(AttitudeTrackingTest, FollowsAnAttitudeThatTurns) {
  const Gains gains = make_default_gains(kInertia);
  Turning turning;
  turning.R = Eigen::AngleAxisd(2.0, Vector3d::UnitX()).toRotationMatrix();
  for (int n = 0; n < 5000; ++n) turning = turn_towards(turning, gains, kStep * n, true);
  // The moment is held at its value in the middle of each step: a second-order error.
  EXPECT_LT(calc_attitude_distance(turning.R, make_wanted(5.0).R_WB), 1e-9);
  EXPECT_LT(calc_rate_error({turning.R, turning.w}, make_wanted(5.0)).norm(), 1e-4);
}

TEST(AttitudeTrackingTest, IsTheSameForEveryHeading) {
  const Gains gains = make_default_gains(kInertia);
  std::mt19937_64 random(43);
  for (int i = 0; i < 100; ++i) {
    Rotation rotation{make_random_attitude(random).toRotationMatrix(), make_random_vector(random)};
    WantedRotation wanted;
    wanted.R_WB = make_random_attitude(random).toRotationMatrix();
    wanted.w_WB_B = make_random_vector(random);
    wanted.w_dot_WB_B = make_random_vector(random);
    const Vector3d moment = calc_moment(rotation, wanted, kInertia, gains);
    const Matrix3d turned = Eigen::AngleAxisd(0.1 * i, Vector3d::UnitZ()).toRotationMatrix();
    rotation.R_WB = turned * rotation.R_WB;
    wanted.R_WB = turned * wanted.R_WB;
    EXPECT_NEAR((calc_moment(rotation, wanted, kInertia, gains) - moment).norm(), 0.0, 1e-12);
  }
}

TEST(AttitudeTrackingTest, SmallErrorsDecayWithTheDocumentedFrequency) {
  // About a principal axis with the mean moment the loop is critically damped at 10 rad/s.
  const Matrix3d ball = 0.04 * Matrix3d::Identity();
  const Gains gains = make_default_gains(ball);
  EXPECT_NEAR(gains.attitude / 0.04, 100.0, 1e-12);
  EXPECT_NEAR(gains.rate / 0.04, 20.0, 1e-12);
  constexpr double kAngle = 1e-4;
  Turning turning;
  turning.R = Eigen::AngleAxisd(kAngle, Vector3d::UnitY()).toRotationMatrix();
  for (int n = 0; n < 300; ++n) {
    const double t = kStep * n;
    // Terms of third order in the angle are neglected.
    ASSERT_NEAR(calc_attitude_error(turning.R, Matrix3d::Identity()).y(),
                kAngle * (1 + 10 * t) * std::exp(-10 * t), 1e-11);
    turning = turn(turning, ball, kStep, [&](const Turning& at) {
      return calc_moment({at.R, at.w}, {}, ball, gains);
    });
  }
}

}  // namespace
}  // namespace sls::sim::geometric
