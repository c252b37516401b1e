#include "control_client/laws/qsf/qsf_law.hpp"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <Eigen/QR>
#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <limits>
#include <random>
#include <vector>

#include "control_client/laws/error_integral.hpp"
#include "control_client/laws/qsf/lqr.hpp"
#include "tests/oracle/slung_load_ode.hpp"

namespace sls::control {
namespace {

using Eigen::Vector3d;

constexpr double kNoNumber = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// One case: a plant and its controller, which has the exact parameters of the plant.
struct Case {
  model::SlungLoadParameters vehicle;
  NamedGains gains;
  oracle::State state;
  model::Reference reference;
  Vector3d integral = Vector3d::Zero();

  QsfInput input() const {
    const model::SlungLoadState sample = oracle::to_model_state(state, vehicle.rod_length);
    return {state.p_WQ, state.v_WQ, sample.rod, reference, integral};
  }
};

Vector3d draw_uniform_vector(std::mt19937& generator, double scale) {
  std::uniform_real_distribution<double> uniform(-scale, scale);
  const double x = uniform(generator), y = uniform(generator), z = uniform(generator);
  return {x, y, z};
}

/// A random case with s > g / 20 and both rod angles up to 1.2 rad.
Case draw_case(std::mt19937& generator, bool with_integral) {
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  const auto between = [&](double low, double high) {
    return low + (high - low) * unit(generator);
  };
  while (true) {
    Case one;
    one.vehicle.quad_mass = between(0.5, 3.0);
    one.vehicle.load_mass = between(0.05, 1.0);
    one.vehicle.rod_length = between(0.3, 2.0);
    one.vehicle.gravity = between(9.0, 10.0);
    one.gains = make_named_gains(LqrWeights{between(1.0, 100.0), between(1.0, 20.0)});
    if (with_integral) {
      one.gains.horizontal.integral = between(0.01, 0.5);
      one.gains.vertical.integral = between(0.01, 0.5);
      one.integral = draw_uniform_vector(generator, 5.0);
      const double z = unit(generator);  // also at either end of its range
      if (z < 0.4) one.integral.z() = z < 0.2 ? kIntegralLimit : -kIntegralLimit;
    }
    const model::RodAngles rod{between(-1.2, 1.2), between(-1.2, 1.2), between(-2.0, 2.0),
                               between(-2.0, 2.0)};
    const model::RodDirection direction = model::to_direction(rod);
    one.state = {draw_uniform_vector(generator, 3.0), draw_uniform_vector(generator, 2.0),
                 direction.n_W, direction.n_dot_W};
    one.reference.position = one.state.p_WQ + one.vehicle.rod_length * direction.n_W +
                             draw_uniform_vector(generator, 1.0);
    one.reference.velocity = draw_uniform_vector(generator, 1.0);
    one.reference.acceleration = draw_uniform_vector(generator, 1.0);
    one.reference.jerk = draw_uniform_vector(generator, 1.0);
    one.reference.snap = draw_uniform_vector(generator, 1.0);
    const double e =
        (one.state.p_WQ + one.vehicle.rod_length * direction.n_W - one.reference.position).z();
    const double e_dot =
        (one.state.v_WQ + one.vehicle.rod_length * direction.n_dot_W - one.reference.velocity).z();
    const double a_z = one.reference.acceleration.z() - one.gains.vertical.velocity * e_dot -
                       one.gains.vertical.position * e -
                       one.gains.vertical.integral * one.integral.z();
    if (one.vehicle.gravity - a_z > one.vehicle.gravity / 20) return one;
  }
}

// --- a second formulation ----------------------------------------------------------------------

/// Truncated Taylor series c₀ + c₁ t + c₂ t².
struct Series {
  std::array<double, 3> c;
};
Series operator*(const Series& a, const Series& b) {
  return {{a.c[0] * b.c[0], a.c[0] * b.c[1] + a.c[1] * b.c[0],
           a.c[0] * b.c[2] + a.c[1] * b.c[1] + a.c[2] * b.c[0]}};
}
Series operator/(const Series& a, const Series& b) {
  Series q{};
  q.c[0] = a.c[0] / b.c[0];
  q.c[1] = (a.c[1] - q.c[0] * b.c[1]) / b.c[0];
  q.c[2] = (a.c[2] - q.c[0] * b.c[2] - q.c[1] * b.c[1]) / b.c[0];
  return q;
}
Series operator-(const Series& a) { return {{-a.c[0], -a.c[1], -a.c[2]}}; }

/// The force that the design requires, without the law's formula:
/// - the designed vertical error comes from powers of its state matrix;
/// - the load's horizontal motion, from Taylor series of Newton's law m_L p̈_L = m_L g e₃ − T n;
/// - the rod's acceleration, from three linear conditions: designed snap in x and y, and |n| = 1;
/// - the force, from the inverse of the oracle, which is affine in the force.
Vector3d solve_for_force(const Case& one) {
  const model::SlungLoadParameters& vehicle = one.vehicle;
  const Vector3d& n = one.state.n_W;
  const Vector3d& n_dot = one.state.n_dot_W;
  const Vector3d e = one.state.p_WQ + vehicle.rod_length * n - one.reference.position;
  const Vector3d e_dot = one.state.v_WQ + vehicle.rod_length * n_dot - one.reference.velocity;

  // Vertical: d/dt (∫e, e, ė) = A (∫e, e, ė); a clamped integral stays constant.
  const AxisGains& vertical = one.gains.vertical;
  const bool clamped =
      std::abs(one.integral.z()) == kIntegralLimit && one.integral.z() * e.z() > 0.0;
  Eigen::Matrix3d A;
  A << 0.0, clamped ? 0.0 : 1.0, 0.0, 0.0, 0.0, 1.0, -vertical.integral, -vertical.position,
      -vertical.velocity;
  const Vector3d x0(one.integral.z(), e.z(), e_dot.z());
  const Vector3d x1 = A * x0, x2 = A * x1, x3 = A * x2;
  const Series support{{vehicle.gravity - one.reference.acceleration.z() - x1[2],
                        -one.reference.jerk.z() - x2[2], -(one.reference.snap.z() + x3[2]) / 2.0}};

  // Horizontal: p̈_L,i = −(g − p̈_L,z) n_i / n_z as a series, for a trial n̈.
  const auto calc_residual = [&](const Vector3d& n_ddot) {
    const auto series_of = [&](int axis) {
      return Series{{n[axis], n_dot[axis], n_ddot[axis] / 2.0}};
    };
    Vector3d residual;
    const AxisGains& horizontal = one.gains.horizontal;
    for (int axis = 0; axis < 2; ++axis) {
      const Series a = -(support * series_of(axis) / series_of(2));
      const double snap = 2.0 * a.c[2];
      residual[axis] = snap - one.reference.snap[axis] +
                       horizontal.jerk * (a.c[1] - one.reference.jerk[axis]) +
                       horizontal.acceleration * (a.c[0] - one.reference.acceleration[axis]) +
                       horizontal.velocity * e_dot[axis] + horizontal.position * e[axis] +
                       horizontal.integral * one.integral[axis];
    }
    residual[2] = n.dot(n_ddot) + n_dot.squaredNorm();
    return residual;
  };
  const Vector3d at_zero = calc_residual(Vector3d::Zero());
  Eigen::Matrix3d slope;
  for (int i = 0; i < 3; ++i) slope.col(i) = calc_residual(Vector3d::Unit(i)) - at_zero;
  const Vector3d n_ddot = -slope.fullPivLu().solve(at_zero);

  // Force: the oracle must give the required (T, n̈); four equations of rank three.
  const auto calc_response = [&](const Vector3d& force) {
    const oracle::Accelerations a = oracle::calc_accelerations(one.state, force, vehicle);
    Eigen::Vector4d response;
    response << a.tension, (a.a_WL - a.a_WQ) / vehicle.rod_length;
    return response;
  };
  Eigen::Vector4d wanted;
  wanted << vehicle.load_mass * support.c[0] / n.z(), n_ddot;
  const Eigen::Vector4d free = calc_response(Vector3d::Zero());
  Eigen::Matrix<double, 4, 3> effect;
  for (int i = 0; i < 3; ++i) effect.col(i) = calc_response(Vector3d::Unit(i)) - free;
  return effect.colPivHouseholderQr().solve(wanted - free);
}

/// Relative tolerance: 1.1e-16 times the condition number for a rod 1.2 rad off on both axes
/// (1 / q_z² = 58) and for s down to g / 20.
constexpr double kRounding = 1.1e-16 * 58 * 20;

TEST(QsfLawTest, AgreesWithAnIndependentFormulationAlsoWithIntegralsAndWhereTheyAreClamped) {
  std::mt19937 generator(2);
  int clamped = 0, held_back = 0;
  for (int i = 0; i < 2000; ++i) {
    const Case one = draw_case(generator, i % 2 == 0);
    const QsfOutput output = calc_qsf(one.input(), one.vehicle, one.gains);
    ASSERT_EQ(output.error_code, ErrorCode::kNone);
    if (std::abs(one.integral.z()) == kIntegralLimit) {
      ++(is_clamped(one.integral.z(), output.load_error.z()) ? clamped : held_back);
    }
    const Vector3d expected = solve_for_force(one);
    ASSERT_LE((output.f_Q_W - expected).norm(), kRounding * expected.norm());
  }
  EXPECT_GT(clamped, 30);  // both cases occurred
  EXPECT_GT(held_back, 30);
}

// --- the closed loop ---------------------------------------------------------------------------

/// Roots of s^n + c[n−1] s^(n−1) + … + c[0].
std::vector<std::complex<double>> calc_roots(const std::vector<double>& c) {
  const Eigen::Index n = static_cast<Eigen::Index>(c.size());
  Eigen::MatrixXd companion = Eigen::MatrixXd::Zero(n, n);
  companion.diagonal(1).setOnes();
  for (Eigen::Index i = 0; i < n; ++i) companion(n - 1, i) = -c[static_cast<std::size_t>(i)];
  const Eigen::VectorXcd roots = companion.eigenvalues();
  return {roots.data(), roots.data() + n};
}

TEST(QsfLawTest, PolesOfTheLinearisedClosedLoopAreTheDesignedOnes) {
  model::SlungLoadParameters vehicle;
  NamedGains gains = make_named_gains(LqrWeights{10.0, 5.0});
  // Coordinates x = (p, v, n_x, n_y, ṅ_x, ṅ_y) about hover with the load at its set-point.
  const auto calc_slope = [&](const Eigen::VectorXd& x) {
    Case one;
    one.vehicle = vehicle;
    one.gains = gains;
    one.state.p_WQ = x.segment<3>(0) - Vector3d(0.0, 0.0, vehicle.rod_length);
    one.state.v_WQ = x.segment<3>(3);
    const Eigen::Vector2d n = x.segment<2>(6), n_dot = x.segment<2>(8);
    const double n_z = std::sqrt(1.0 - n.squaredNorm());
    one.state.n_W << n, n_z;
    one.state.n_dot_W << n_dot, -n.dot(n_dot) / n_z;
    const Vector3d force = calc_qsf(one.input(), vehicle, gains).f_Q_W;
    const oracle::State slope = oracle::calc_derivative(one.state, force, vehicle);
    Eigen::VectorXd x_dot(10);
    x_dot << slope.p_WQ, slope.v_WQ, slope.n_W.head<2>(), slope.n_dot_W.head<2>();
    return x_dot;
  };
  Eigen::MatrixXd jacobian(10, 10);
  const double h = 1e-3;
  for (int i = 0; i < 10; ++i) {
    const Eigen::VectorXd d = h * Eigen::VectorXd::Unit(10, i);
    jacobian.col(i) =
        (8.0 * (calc_slope(d) - calc_slope(-d)) - (calc_slope(2 * d) - calc_slope(-2 * d))) /
        (12.0 * h);
  }
  const Eigen::VectorXcd poles = jacobian.eigenvalues();

  const AxisGains& xy = gains.horizontal;
  const AxisGains& z = gains.vertical;
  std::vector<std::complex<double>> designed = calc_roots({z.position, z.velocity});
  for (int axis = 0; axis < 2; ++axis) {
    for (const auto& root : calc_roots({xy.position, xy.velocity, xy.acceleration, xy.jerk})) {
      designed.push_back(root);
    }
  }
  ASSERT_EQ(designed.size(), 10u);
  for (const std::complex<double>& pole : poles) {
    const auto nearest = std::min_element(
        designed.begin(), designed.end(),
        [&](const auto& a, const auto& b) { return std::abs(a - pole) < std::abs(b - pole); });
    // Differences: truncation h⁴ of fifth derivatives of some 1e3, rounding 1e-12.
    EXPECT_LE(std::abs(*nearest - pole), 1e-7) << pole;
    designed.erase(nearest);
  }
}

TEST(QsfLawTest, HoversWithTheWeightOfBoth) {
  Case one;
  one.gains = make_named_gains(LqrWeights{});
  one.state.p_WQ << 1.0, 2.0, -3.0;
  one.reference.position << 1.0, 2.0, -2.0;
  const QsfOutput output = calc_qsf(one.input(), one.vehicle, one.gains);
  EXPECT_LE((output.f_Q_W - Vector3d(0.0, 0.0, -1.7 * 9.8)).norm(), 1e-14);
  EXPECT_EQ(output.load_error, Vector3d::Zero());
}

TEST(QsfLawTest, SeesTheLoadWhereItsOwnModelPutsIt) {
  Case one;
  one.vehicle.rod_length = 1.1;
  one.state.n_W = Vector3d(0.6, 0.0, 0.8);
  model::SlungLoadParameters believed = one.vehicle;
  believed.rod_length = 1.0;
  const QsfOutput output = calc_qsf(one.input(), believed, one.gains);
  EXPECT_LE((output.load_error - Vector3d(0.6, 0.0, 0.8)).norm(), 1e-15);
}

TEST(QsfLawTest, IntegratesTheErrorOfAxesThatHaveAnIntegralGain) {
  Case one;
  one.gains = make_named_gains(LqrWeights{});
  one.reference.position << 0.25, -0.5, 0.875;
  EXPECT_EQ(calc_qsf(one.input(), one.vehicle, one.gains).integral_rate, Vector3d::Zero());
  one.gains.vertical.integral = 0.1;
  EXPECT_EQ(calc_qsf(one.input(), one.vehicle, one.gains).integral_rate, Vector3d(0, 0, 0.125));
  one.gains.horizontal.integral = 0.1;
  EXPECT_EQ(calc_qsf(one.input(), one.vehicle, one.gains).integral_rate,
            Vector3d(-0.25, 0.5, 0.125));
}

// --- faults ------------------------------------------------------------------------------------

void expect_error_code(const Case& one, ErrorCode error_code) {
  const QsfOutput output = calc_qsf(one.input(), one.vehicle, one.gains);
  EXPECT_EQ(output.error_code, error_code);
  EXPECT_EQ(output.f_Q_W, Vector3d::Zero());
}

TEST(QsfLawTest, ReportsFreeFallWhereTheReferenceFallsFreely) {
  Case one;
  one.gains = make_named_gains(LqrWeights{});
  one.state.p_WQ << 0.0, 0.0, -1.0;  // no error
  const double g = one.vehicle.gravity;
  for (const double fraction : {0.9995, 1.0, 1.0005, 2.0}) {
    one.reference.acceleration << 0.0, 0.0, fraction * g;
    expect_error_code(one, ErrorCode::kFreeFall);
  }
  one.reference.acceleration << 0.0, 0.0, (1.0 - 2.0 * kMinSupportFraction) * g;
  EXPECT_EQ(calc_qsf(one.input(), one.vehicle, one.gains).error_code, ErrorCode::kNone);
}

TEST(QsfLawTest, ReportsALevelRodAndALoadAboveTheQuadrotor) {
  const double half_pi = 1.57079632679489661923;
  Case one;
  one.gains = make_named_gains(LqrWeights{});
  QsfInput input = one.input();
  for (const double angle : {half_pi, half_pi - 0.5 * kMinRodCosine, 2.0, 3.1, -half_pi, -2.5}) {
    for (double model::RodAngles::*slot : {&model::RodAngles::alpha, &model::RodAngles::beta}) {
      input.rod = {};
      input.rod.*slot = angle;
      // Load at its reference: a large error could make s small and cause another fault.
      one.reference.position = model::to_direction(input.rod).n_W;
      const QsfOutput output = calc_qsf(input, one.vehicle, one.gains);
      EXPECT_EQ(output.error_code, ErrorCode::kRodLevel) << angle;
      EXPECT_EQ(output.f_Q_W, Vector3d::Zero());
    }
  }
  // With both cosines negative the load hangs below again, but the angles are out of range.
  input.rod = {2.5, 2.5, 0.0, 0.0};
  EXPECT_EQ(calc_qsf(input, one.vehicle, one.gains).error_code, ErrorCode::kRodLevel);
  input.rod = {half_pi - 2.0 * kMinRodCosine, 0.0, 0.0, 0.0};
  one.reference.position = model::to_direction(input.rod).n_W;
  EXPECT_EQ(calc_qsf(input, one.vehicle, one.gains).error_code, ErrorCode::kNone);
}

TEST(QsfLawTest, AHugeForceIsTheServersToJudge) {
  Case one;
  one.gains = make_named_gains(LqrWeights{});
  one.reference.position << 1e6, 0.0, 0.0;
  const QsfOutput output = calc_qsf(one.input(), one.vehicle, one.gains);
  EXPECT_EQ(output.error_code, ErrorCode::kNone);
  EXPECT_GT(output.f_Q_W.norm(), 1e5);
}

TEST(QsfLawTest, ReportsInputAndForceThatAreNotFinite) {
  Case one;
  one.gains = make_named_gains(LqrWeights{});
  for (const double bad : {kNoNumber, kInfinity, -kInfinity}) {
    Case broken = one;
    broken.state.v_WQ.y() = bad;
    expect_error_code(broken, ErrorCode::kNotFinite);
    broken = one;
    broken.reference.snap.x() = bad;
    expect_error_code(broken, ErrorCode::kNotFinite);
  }
  one.reference.position << 1e308, 0.0, 0.0;  // finite, but its force is not
  expect_error_code(one, ErrorCode::kNotFinite);
}

TEST(QsfLawTest, NeverGivesANumberThatIsNotFinite) {
  std::mt19937 generator(5);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  const auto draw = [&]() {
    const double kind = unit(generator), sign = unit(generator) < 0.5 ? -1.0 : 1.0;
    if (kind < 0.02) return kNoNumber;
    if (kind < 0.04) return sign * kInfinity;
    if (kind < 0.3) return sign * std::pow(10.0, -320.0 + 628.0 * unit(generator));
    return sign * 4.0 * unit(generator);
  };
  const auto draw3 = [&]() {
    const double x = draw(), y = draw(), z = draw();
    return Vector3d(x, y, z);
  };
  const NamedGains gains = make_named_gains(LqrWeights{});
  for (int i = 0; i < 50000; ++i) {
    model::Reference reference;
    QsfInput input{{}, {}, {}, reference, Vector3d::Zero()};
    input.p_WQ = draw3();
    input.v_WQ = draw3();
    input.rod = {draw(), draw(), draw(), draw()};
    if (i % 2 == 0) reference.position = draw3();
    if (i % 3 == 0) reference.snap = draw3();
    if (i % 5 == 0) input.integral = draw3();
    const QsfOutput output = calc_qsf(input, {}, gains);
    ASSERT_TRUE(output.f_Q_W.allFinite());
    if (output.error_code != ErrorCode::kNone) {
      ASSERT_EQ(output.f_Q_W, Vector3d::Zero());
    }
  }
}

TEST(ErrorIntegralTest, AdvancesByForwardEuler) {
  EXPECT_EQ(calc_next_integral({1.0, -2.0, 0.0}, {0.5, 0.25, -4.0}, 0.25),
            Eigen::Vector3d(1.125, -1.9375, -1.0));
}

TEST(ErrorIntegralTest, StopsAtTheLimitOfEachAxisAndComesBack) {
  Eigen::Vector3d integral(19.9, -19.9, 0.0);
  for (int i = 0; i < 100; ++i) integral = calc_next_integral(integral, {1.0, -1.0, 0.5}, 0.25);
  EXPECT_EQ(integral, Eigen::Vector3d(20.0, -20.0, 12.5));
  EXPECT_EQ(calc_next_integral(integral, {-1.0, 1.0, 0.0}, 0.25),
            Eigen::Vector3d(19.75, -19.75, 12.5));
}

TEST(ErrorIntegralTest, IsClampedOnlyAtTheLimitAndPushedOutwards) {
  EXPECT_TRUE(is_clamped(20.0, 0.1));
  EXPECT_TRUE(is_clamped(-20.0, -0.1));
  EXPECT_FALSE(is_clamped(20.0, -0.1));
  EXPECT_FALSE(is_clamped(-20.0, 0.1));
  EXPECT_FALSE(is_clamped(19.999, 0.1));
  EXPECT_FALSE(is_clamped(20.0, 0.0));
}

}  // namespace
}  // namespace sls::control
