// The law against a centralised computation, and against the second formulation of the mechanics of
// cables (cables_oracle.hpp), which shares no code with it.
#include "control_client/laws/cooperative/cooperative_law.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <limits>
#include <random>
#include <vector>

#include "control_client/reference_trajectory.hpp"
#include "tests/sim_server/plants/cables_oracle.hpp"

namespace sls::control {
namespace {

using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;
using model::SharedLoad;
namespace oracle = sim::cables::oracle;

constexpr double kGravity = 9.8;
const Vector3d kDown(0.0, 0.0, kGravity);

/// A load, its vehicles, and where everything is.
struct Group {
  SharedLoad load;
  std::vector<double> vehicle_mass, length;
  Vector3d p = Vector3d::Zero(), v = Vector3d::Zero(), w = Vector3d::Zero();  // w in the load
  Matrix3d R = Matrix3d::Identity();
  std::vector<Vector3d> n, n_dot;  // of the cables
  CooperativeKeys keys;
  model::Reference reference;
  model::AttitudeReference attitude;

  std::size_t count() const { return load.cables.size(); }
  double load_mass() const {
    double sum = 0.0;
    for (const auto& cable : load.cables) sum += cable.load_share;
    return sum;
  }
  Vector3d arm(std::size_t i) const { return R * load.cables[i].attachment_L; }

  CooperativeLaw make_law(std::size_t i) const {
    return {load, i, {vehicle_mass[i], load.cables[i].load_share, length[i], kGravity}, keys};
  }

  LawInput make_input(std::size_t i) const {
    LawInput input;
    input.state.p_WL = p + arm(i);
    input.state.v_WL = v + (R * w).cross(arm(i));
    input.state.p_WQ = input.state.p_WL - length[i] * n[i];
    input.state.v_WQ = input.state.v_WL - length[i] * n_dot[i];
    input.state.rod = model::to_angles({n[i], n_dot[i]});
    const Eigen::Quaterniond q(R);
    input.state.signals.resize(SharedLoad::kSignals);
    input.state.signals << 0.0, length[i], 1.0, q.w(), q.x(), q.y(), q.z(), w;
    input.load_reference = reference;
    input.load_attitude = attitude;
    return input;
  }

  /// Accelerations by the second formulation: of the load, its rates in W, and each vehicle.
  VectorXd calc_accelerations() const {
    sim::cables::System system;
    sim::cables::Motion motion;
    sim::cables::Actions actions;
    system.count = count();
    system.load_mass = load_mass();
    system.gravity = kGravity;
    system.is_rigid = load.inertia_L.has_value();
    if (system.is_rigid) system.inertia_L = *load.inertia_L;
    const Eigen::Quaterniond q(R);
    motion.p_WL = p;
    motion.v_WL = v;
    motion.q_WL << q.w(), q.x(), q.y(), q.z();
    motion.w_WL_L = w;
    for (std::size_t i = 0; i < count(); ++i) {
      system.vehicle_mass[i] = vehicle_mass[i];
      system.attachment_L[i] = load.cables[i].attachment_L;
      const LawInput input = make_input(i);
      motion.vehicles[i] = {input.state.p_WQ, input.state.v_WQ, length[i], 0.0};
      const LawOutput output = make_law(i).calc(input);
      EXPECT_EQ(output.error_code, ErrorCode::kNone);
      actions.f_Q_W[i] = output.f_Q_W;
    }
    const oracle::Equations equations(system, motion, actions);
    const auto solution = oracle::solve(equations, equations.force, -equations.speed_terms,
                                        std::vector<bool>(count(), true));
    EXPECT_TRUE(solution);
    for (const bool pulls : solution->pulls) EXPECT_TRUE(pulls);
    return solution->change;
  }

  /// Puts every cable where the law wants it.
  void align() {
    for (std::size_t i = 0; i < count(); ++i) {
      const Jet pull = make_law(i).calc_plan(make_input(i)).pull_W;
      const double strength = pull.value.norm();
      n[i] = -pull.value / strength;
      n_dot[i] = -(pull.first + n[i] * -n[i].dot(pull.first)) / strength;
    }
  }
};

/// An equilateral triangle of 0.3 m on cables of 0.8 m, at rest on its reference.
Group make_triangle() {
  Group group;
  group.load.inertia_L = Vector3d(0.006, 0.006, 0.012).asDiagonal();
  for (int i = 0; i < 3; ++i) {
    const double angle = 2.0 * M_PI * i / 3.0;
    group.load.cables.push_back({0.1, {0.3 * std::cos(angle), 0.3 * std::sin(angle), 0.0}});
  }
  group.vehicle_mass.assign(3, 0.25);
  group.length.assign(3, 0.8);
  group.n.assign(3, Vector3d::UnitZ());
  group.n_dot.assign(3, Vector3d::Zero());
  return group;
}

/// A load without any symmetry that moves, and a reference that moves otherwise.
Group make_any(std::mt19937& random, std::size_t count, bool is_rigid = true) {
  std::uniform_real_distribution<double> any(-1.0, 1.0), positive(0.2, 1.0);
  const auto vector = [&](double size) {
    return Vector3d(size * any(random), size * any(random), size * any(random));
  };
  Group group;
  if (is_rigid) {
    Matrix3d inertia = Matrix3d::Zero();
    for (int i = 0; i < 6; ++i) {
      const Matrix3d of_point = oracle::cross_matrix(vector(0.2));
      inertia -= 0.1 * of_point * of_point;
    }
    group.load.inertia_L = inertia;
  }
  for (std::size_t i = 0; i < count; ++i) {
    group.load.cables.push_back({positive(random), is_rigid ? vector(0.4) : Vector3d::Zero()});
    group.vehicle_mass.push_back(positive(random));
    group.length.push_back(positive(random));
    group.n.push_back((Vector3d::UnitZ() + vector(0.2)).normalized());
    group.n_dot.push_back(group.n[i].cross(vector(1.0)));
  }
  // Every cable pulls at rest, because the middle of the attachments is near the centre of mass.
  Vector3d middle = Vector3d::Zero();
  for (const auto& cable : group.load.cables)
    middle += cable.attachment_L / static_cast<double>(count);
  for (auto& cable : group.load.cables)
    if (is_rigid) cable.attachment_L += Vector3d(0.01, -0.02, -0.05) - middle;
  group.keys.spread = 0.3;
  group.p = vector(0.1);
  group.v = vector(0.2);
  if (is_rigid) {
    group.w = vector(0.3);
    group.R = Eigen::AngleAxisd(0.2, vector(1.0).normalized()).toRotationMatrix();
    group.attitude.R_WL = Eigen::AngleAxisd(0.2, vector(1.0).normalized()).toRotationMatrix();
    group.attitude.axis_L = vector(1.0).normalized();
    group.attitude.turn << 0.3, -0.4, 0.5, -0.6;
  }
  group.reference = {vector(0.1), vector(0.2), vector(0.3), vector(0.4), vector(0.5)};
  return group;
}

Vector3d calc_turn(const Matrix3d& m) {
  return 0.5 * Vector3d(m(2, 1) - m(1, 2), m(0, 2) - m(2, 0), m(1, 0) - m(0, 1));
}

TEST(CooperativeLawTest, SharesEqualACentralComputationOfTheWholeGroup) {
  std::mt19937 random(1);
  for (int trial = 0; trial < 50; ++trial) {
    Group group = make_any(random, 3 + static_cast<std::size_t>(trial) % 14);
    group.keys.spread = 0.0;
    const auto n = static_cast<Eigen::Index>(group.count());
    // The wanted force and moment in world axes, as in Lee (2018), eqs. (26) to (31).
    const CooperativeGains& k = group.keys.gains;
    const Matrix3d &R = group.R, &R_d = group.attitude.R_WL;
    const Vector3d e = group.p - group.reference.position, e_v = group.v - group.reference.velocity;
    const Vector3d force = group.load_mass() * (group.reference.acceleration - k.position * e -
                                                k.velocity * e_v - kDown);
    const Vector3d w_d = group.attitude.turn[0] * group.attitude.axis_L;
    const Vector3d w_d_dot = group.attitude.turn[1] * group.attitude.axis_L;
    const Vector3d e_R = calc_turn(R_d.transpose() * R), e_w = group.w - R.transpose() * R_d * w_d;
    const Vector3d turn = -k.attitude * e_R - k.rates * e_w -
                          group.w.cross(R.transpose() * R_d * w_d) + R.transpose() * R_d * w_d_dot;
    const Matrix3d& J = *group.load.inertia_L;
    const Vector3d moment = R * (J * turn + group.w.cross(J * group.w));
    // All forces at once by the singular values of the map from forces to force and moment.
    MatrixXd map(6, 3 * n);
    for (Eigen::Index i = 0; i < n; ++i)
      map.middleCols<3>(3 * i) << Matrix3d::Identity(),
          oracle::cross_matrix(group.arm(static_cast<std::size_t>(i)));
    VectorXd wrench(6);
    wrench << force, moment;
    const VectorXd shares = map.jacobiSvd(Eigen::ComputeThinU | Eigen::ComputeThinV).solve(wrench);

    VectorXd of_laws(3 * n);
    for (std::size_t i = 0; i < group.count(); ++i)
      of_laws.segment<3>(3 * static_cast<Eigen::Index>(i)) =
          group.make_law(i).calc_plan(group.make_input(i)).pull_W.value;
    EXPECT_LE((of_laws - shares).norm(), 1e-12 * shares.norm()) << trial;
    EXPECT_LE((map * of_laws - wrench).norm(), 1e-12 * wrench.norm()) << trial;
  }
}

TEST(CooperativeLawTest, InternalForcesHaveNoSumAndNoMomentAndTheAngleThatTheKeySays) {
  std::mt19937 random(2);
  for (const std::size_t count : {3, 4, 7, 16}) {
    const Group group = make_any(random, count);
    const std::vector<Vector3d> forces = Distribution(group.load).calc_internal(2.0);
    Vector3d sum = Vector3d::Zero(), moment = Vector3d::Zero();
    for (std::size_t i = 0; i < count; ++i) {
      sum += forces[i];
      moment += group.load.cables[i].attachment_L.cross(forces[i]);
    }
    EXPECT_LE(sum.norm(), 1e-13);
    EXPECT_LE(moment.norm(), 1e-13);
  }
  Group triangle = make_triangle();
  triangle.keys.spread = 0.35;
  triangle.align();
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_NEAR(std::acos(triangle.n[i].z()), 0.35, 1e-12);
    EXPECT_LT(triangle.n[i].dot(triangle.arm(i)), 0.0) << "the vehicle is not outside";
  }
  // A point: the vehicles hover above the corners of a regular polygon.
  Group point = make_any(random, 5, false);
  for (auto& cable : point.load.cables) cable.load_share = 0.1;
  point.reference = {};
  point.p = point.v = Vector3d::Zero();
  point.align();
  for (std::size_t i = 0; i < 5; ++i) {
    EXPECT_NEAR(std::acos(point.n[i].z()), 0.3, 1e-12);
    EXPECT_NEAR((point.n[i] - point.n[(i + 1) % 5]).norm(),
                2.0 * std::sin(0.3) * std::sin(M_PI / 5.0), 1e-12);
  }
}

TEST(CooperativeLawTest, HoldsTheWeightAtRest) {
  const Group triangle = make_triangle();
  for (std::size_t i = 0; i < 3; ++i) {
    const LawOutput output = triangle.make_law(i).calc(triangle.make_input(i));
    EXPECT_LE((output.f_Q_W - Vector3d(0.0, 0.0, -(0.25 + 0.1) * kGravity)).norm(), 1e-14);
    EXPECT_EQ(output.memory.size(), 0);
  }
  // Any load in any attitude: nothing accelerates.
  std::mt19937 random(3);
  for (const bool is_rigid : {true, true, true, false}) {
    Group group = make_any(random, is_rigid ? 5 : 4, is_rigid);
    group.reference = {};
    group.reference.position = group.p;
    group.v = group.w = Vector3d::Zero();
    group.attitude.R_WL = group.R;
    group.attitude.turn.setZero();
    group.align();
    EXPECT_LE(group.calc_accelerations().norm(), 1e-11);  // of forces of 10 N on 0.2 kg
  }
}

TEST(CooperativeLawTest, OnItsWantedDirectionsTheLoadMovesExactlyAsDesigned) {
  std::mt19937 random(4);
  for (int trial = 0; trial < 30; ++trial) {
    const bool is_rigid = trial % 5 != 0;
    Group group =
        make_any(random, is_rigid ? 3 + static_cast<std::size_t>(trial) % 5 : 3, is_rigid);
    // Room for the moments that a random attitude error needs.
    for (auto& cable : group.load.cables) cable.load_share += 1.0;
    group.align();
    const CooperativePlan plan = group.make_law(0).calc_plan(group.make_input(0));
    const VectorXd change = group.calc_accelerations();
    EXPECT_LE((change.head<3>() - plan.a_WL).norm(), 1e-10) << trial;
    if (is_rigid) {
      EXPECT_LE((change.segment<3>(3) - plan.R_WL * plan.w_L.first).norm(), 1e-10) << trial;
    }
    // The cables keep following their wanted directions: n̈ is the second derivative of (10).
    for (std::size_t i = 0; i < group.count(); ++i) {
      const Jet pull = group.make_law(i).calc_plan(group.make_input(i)).pull_W;
      const double h = 1e-4;
      const auto direction = [&](double t) {
        return Vector3d(-(pull.value + t * pull.first + 0.5 * t * t * pull.second).normalized());
      };
      const Vector3d wanted = (direction(h) - 2.0 * direction(0.0) + direction(-h)) / (h * h);
      const Vector3d a_end =
          plan.a_WL + plan.R_WL * (plan.w_L.first.cross(group.load.cables[i].attachment_L) +
                                   group.w.cross(group.w.cross(group.load.cables[i].attachment_L)));
      const Vector3d n_ddot =
          (a_end - change.segment<3>(6 + 3 * static_cast<Eigen::Index>(i))) / group.length[i];
      EXPECT_LE((n_ddot - wanted).norm(), 1e-5 * (1.0 + wanted.norm())) << trial;  // 1e-16 / h²
    }
  }
}

/// The load alone, moved as designed. Its references are functions of time.
TEST(CooperativeLawTest, DerivativesAreThoseAlongTheDesignedMotion) {
  config::RestToRestReference way;
  way.from << 0.3, -0.2, -1.0;
  way.to << -0.4, 0.5, -1.5;
  way.duration_s = 2.0;
  way.from_attitude = Vector3d(0.1, -0.2, 0.3);
  way.to_attitude = Vector3d(-0.3, 0.2, 1.2);
  const RestToRest position(way);
  const AttitudeTrajectory attitude(way, Eigen::Quaterniond::Identity());
  std::mt19937 random(5);
  Group group = make_any(random, 4);
  const double start = 0.8;
  const auto plan_at = [&](double t) {
    group.reference = position.calc(t);
    group.attitude = attitude.calc(t);
    return group.make_law(1).calc_plan(group.make_input(1));
  };
  struct State {
    Vector3d p, v, w;
    Eigen::Vector4d q;  // w, x, y, z
  };
  const auto set = [&](const State& state) {
    group.p = state.p;
    group.v = state.v;
    group.w = state.w;
    group.R = Eigen::Quaterniond(state.q[0], state.q[1], state.q[2], state.q[3])
                  .normalized()
                  .toRotationMatrix();
  };
  const auto rate = [&](double t, const State& state) {
    set(state);
    const CooperativePlan plan = plan_at(t);
    const Eigen::Quaterniond q(state.q[0], state.q[1], state.q[2], state.q[3]);
    const Eigen::Quaterniond turn =
        q * Eigen::Quaterniond(0.0, state.w.x(), state.w.y(), state.w.z());
    return State{state.v, plan.a_WL, plan.w_L.first,
                 0.5 * Eigen::Vector4d(turn.w(), turn.x(), turn.y(), turn.z())};
  };
  const auto add = [](const State& a, double h, const State& b) {
    return State{a.p + h * b.p, a.v + h * b.v, a.w + h * b.w, a.q + h * b.q};
  };
  const Eigen::Quaterniond q0(group.R);
  const State begin{group.p, group.v, group.w, {q0.w(), q0.x(), q0.y(), q0.z()}};
  const auto move = [&](double h) {  // Runge-Kutta: errors of 1e-3⁵
    const State a = rate(start, begin), b = rate(start + h / 2, add(begin, h / 2, a)),
                c = rate(start + h / 2, add(begin, h / 2, b)),
                d = rate(start + h, add(begin, h, c));
    set(add(begin, h / 6, add(add(add(a, 2, b), 2, c), 1, d)));
    return plan_at(start + h);
  };
  const double h = 1e-3;
  const CooperativePlan at[] = {move(-h), move(-h / 2), move(0.0), move(h / 2), move(h)};
  const auto expect_jet = [&](Jet CooperativePlan::*jet) {
    const auto differentiate = [&](Vector3d Jet::*part) {  // errors of h⁴
      const auto get = [&](int i) { return Vector3d(at[i].*jet.*part); };
      return Vector3d((8.0 * (get(3) - get(1)) - (get(4) - get(0))) / (6.0 * h));
    };
    const Jet& now = at[2].*jet;
    // 1e-12 times a fifth derivative, which is below 1e4
    EXPECT_LE((differentiate(&Jet::value) - now.first).norm(), 1e-8);
    EXPECT_LE((differentiate(&Jet::first) - now.second).norm(), 1e-8);
    EXPECT_GT(now.second.norm(), 0.01) << "this shows nothing";
  };
  expect_jet(&CooperativePlan::w_L);
  expect_jet(&CooperativePlan::force_L);
  expect_jet(&CooperativePlan::moment_L);
  expect_jet(&CooperativePlan::pull_W);
}

// --- linearised loop -----------------------------------------------------------------------------

/// System matrix about rest: load position, turn, two angles of each cable; then their rates.
MatrixXd calc_linearised_loop(Group group) {
  group.align();
  const std::vector<Vector3d> n = group.n;
  const Matrix3d R = group.R;
  const auto angles = 6 + 2 * static_cast<Eigen::Index>(group.count());
  const auto basis = [&](std::size_t i) {  // two unit vectors across the cable
    Eigen::Matrix<double, 3, 2> across;
    across.col(0) = n[i].cross(Vector3d::UnitX()).normalized();
    across.col(1) = n[i].cross(across.col(0));
    return across;
  };
  const auto calc_rates = [&](const VectorXd& x) {
    const VectorXd q = x.head(angles), q_dot = x.tail(angles);
    group.p = q.head<3>();
    group.v = q_dot.head<3>();
    const Vector3d turn = q.segment<3>(3);
    group.R = R;
    if (turn.norm() > 0.0) group.R = R * Eigen::AngleAxisd(turn.norm(), turn.normalized());
    group.w = q_dot.segment<3>(3);
    for (std::size_t i = 0; i < group.count(); ++i) {
      const auto at = 6 + 2 * static_cast<Eigen::Index>(i);
      group.n[i] = (n[i] + basis(i) * q.segment<2>(at)).normalized();
      group.n_dot[i] = basis(i) * q_dot.segment<2>(at);
      group.n_dot[i] -= group.n[i] * group.n[i].dot(group.n_dot[i]);
    }
    const VectorXd change = group.calc_accelerations();
    VectorXd rates(2 * angles);
    rates << q_dot, change.head<3>(), R.transpose() * change.segment<3>(3),
        VectorXd::Zero(angles - 6);
    for (std::size_t i = 0; i < group.count(); ++i) {
      const auto at = static_cast<Eigen::Index>(i);
      const Vector3d a_end = change.head<3>() + change.segment<3>(3).cross(group.arm(i));
      const Vector3d n_ddot = (a_end - change.segment<3>(6 + 3 * at)) / group.length[i];
      rates.segment<2>(angles + 6 + 2 * at) = basis(i).transpose() * n_ddot;
    }
    return rates;
  };
  MatrixXd A(2 * angles, 2 * angles);
  const double d = 1e-5;
  for (Eigen::Index column = 0; column < 2 * angles; ++column) {
    VectorXd x = VectorXd::Zero(2 * angles);
    x[column] = d;
    A.col(column) = (calc_rates(x) - calc_rates(-x)) / (2.0 * d);
  }
  if (!group.load.inertia_L)  // the turn of a point is no state
    for (const Eigen::Index block : {Eigen::Index(3), angles + 3}) A.middleRows<3>(block).setZero();
  return A;
}

/// Number of eigenvalues at `pole`. Differences have errors of d² = 1e-10, relative to the largest
/// entries (1e3); a double eigenvalue may move by the square root.
int count_poles(const Eigen::VectorXcd& eigenvalues, std::complex<double> pole,
                double tolerance = 1e-3) {
  return static_cast<int>(std::count_if(eigenvalues.begin(), eigenvalues.end(), [&](const auto& s) {
    return std::abs(s - pole) < tolerance;
  }));
}

/// The two solutions of s² + b s + c = 0.
std::array<std::complex<double>, 2> solve_square(double b, double c) {
  const std::complex<double> root = std::sqrt(std::complex<double>(b * b - 4.0 * c));
  return {(-b + root) / 2.0, (-b - root) / 2.0};
}

/// Gains with distinct poles: −1 and −3; −2 and −5.
const CooperativeGains kDistinct{3.0, 4.0, 10.0, 7.0, 220.0, 31.0};

TEST(CooperativeLawTest, NearRestTheLoadHasTheDesignedPolesAndTheCablesThoseOfEquation13) {
  Group triangle = make_triangle();
  triangle.keys.gains = kDistinct;
  const CooperativeGains& k = triangle.keys.gains;
  const Eigen::VectorXcd found = calc_linearised_loop(triangle).eigenvalues();
  ASSERT_EQ(found.size(), 24);
  for (const double pole : {-1.0, -3.0, -2.0, -5.0})
    EXPECT_EQ(count_poles(found, pole), 3) << pole << "\n" << found;
  // All cables swing alike; about the vertical; and in three ways that do not move the load.
  const auto expect_pair = [&](double b, double c, int times) {
    for (const auto& pole : solve_square(b, c))
      EXPECT_EQ(count_poles(found, pole), times) << pole << "\n" << found;
  };
  const auto expect_coupled = [&](double k_p, double k_v, double stiffness, int times) {
    const double b = k.cable_rate - k_v;
    expect_pair(b, k.cable_angle + stiffness - k_p - k_v * b, times);
  };
  const double pull = 0.3 * kGravity, length = 0.8;
  expect_coupled(k.position, k.velocity, pull / (0.3 * length), 2);
  expect_coupled(k.attitude, k.rates, pull * 0.3 * 0.3 / (0.012 * length), 1);
  expect_pair(k.cable_rate, k.cable_angle, 3);
}

TEST(CooperativeLawTest, AnyGroupIsStableAndItsLoadHasTheDesignedPoles) {
  std::mt19937 random(6);
  for (int trial = 0; trial < 12; ++trial) {
    const bool is_rigid = trial % 4 != 0;
    Group group = make_any(random, 3 + static_cast<std::size_t>(trial) % 4, is_rigid);
    group.keys.gains = kDistinct;
    group.keys.spread = trial % 2 == 0 ? 0.4 : 0.2;
    group.reference = {};
    group.p = group.v = group.w = Vector3d::Zero();
    group.attitude = {};
    group.R = Matrix3d::Identity();
    if (is_rigid) {
      // Vehicles as on a plate: attachments above the centre of mass.
      for (auto& cable : group.load.cables) cable.attachment_L.z() = -0.05;
      if (trial % 3 == 0)
        group.R = group.attitude.R_WL =
            Eigen::AngleAxisd(0.3, Vector3d(1.0, -1.0, 2.0).normalized()).toRotationMatrix();
    }
    const Eigen::VectorXcd found = calc_linearised_loop(group).eigenvalues();
    for (const double pole : {-1.0, -3.0}) EXPECT_GE(count_poles(found, pole), 3) << trial;
    for (const double pole : {-2.0, -5.0}) {
      EXPECT_GE(count_poles(found, pole), is_rigid ? 3 : 0) << trial;
    }
    const auto stable =
        std::count_if(found.begin(), found.end(), [](const auto& s) { return s.real() < -0.5; });
    EXPECT_EQ(stable, found.size() - (is_rigid ? 0 : 6)) << trial << "\n" << found;
  }
}

TEST(CooperativeLawTest, ATurnOfEverythingAboutTheVerticalTurnsTheForces) {
  std::mt19937 random(7);
  const Group group = make_any(random, 5);
  Group turned = group;
  const Matrix3d turn = Eigen::AngleAxisd(1.1, Vector3d::UnitZ()).toRotationMatrix();
  turned.p = turn * group.p;
  turned.v = turn * group.v;
  turned.R = turn * group.R;
  turned.attitude.R_WL = turn * group.attitude.R_WL;
  for (Vector3d* part :
       {&turned.reference.position, &turned.reference.velocity, &turned.reference.acceleration,
        &turned.reference.jerk, &turned.reference.snap})
    *part = turn * *part;
  for (std::size_t i = 0; i < group.count(); ++i) {
    turned.n[i] = turn * group.n[i];
    turned.n_dot[i] = turn * group.n_dot[i];
  }
  for (std::size_t i = 0; i < group.count(); ++i) {
    const Vector3d force = group.make_law(i).calc(group.make_input(i)).f_Q_W;
    EXPECT_GT(force.norm(), 1.0);
    EXPECT_LE((turned.make_law(i).calc(turned.make_input(i)).f_Q_W - turn * force).norm(),
              1e-12 * force.norm());
  }
}

TEST(CooperativeLawTest, ABelievedShareScalesTheLoad) {
  const Group triangle = make_triangle();
  const CooperativeLaw law(triangle.load, 1, {0.25, 0.11, 0.8, kGravity}, {});
  EXPECT_NEAR(law.calc(triangle.make_input(1)).f_Q_W.z(), -(0.25 + 0.11) * kGravity, 1e-14);
}

TEST(CooperativeLawTest, ReportsFaultsWithoutForceOrNan) {
  const Group triangle = make_triangle();
  const CooperativeLaw law = triangle.make_law(0);
  const auto expect_code = [&](const LawInput& input, ErrorCode code) {
    const LawOutput output = law.calc(input);
    EXPECT_EQ(output.error_code, code);
    EXPECT_EQ(output.f_Q_W, Vector3d::Zero());
  };
  LawInput falling = triangle.make_input(0);
  falling.load_reference.position.z() = 100.0;
  expect_code(falling, ErrorCode::kFreeFall);
  LawInput level = triangle.make_input(0);
  level.state.rod.alpha = 1.5707;
  expect_code(level, ErrorCode::kRodLevel);
  LawInput broken = triangle.make_input(0);
  broken.state.v_WL.x() = std::numeric_limits<double>::infinity();
  expect_code(broken, ErrorCode::kNotFinite);
  broken = triangle.make_input(0);
  broken.state.signals[SharedLoad::kRates] = std::numeric_limits<double>::quiet_NaN();
  expect_code(broken, ErrorCode::kNotFinite);
  broken = triangle.make_input(0);
  broken.state.signals.resize(0);
  expect_code(broken, ErrorCode::kNotFinite);
}

}  // namespace
}  // namespace sls::control
