#include "sim_server/plants/cables/mechanics.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cstdlib>

#include "tests/sim_server/plants/cables_flights.hpp"
#include "tests/sim_server/plants/cables_oracle.hpp"

namespace sls::sim::cables {
namespace {

using Eigen::Vector3d;
using oracle::Scene, oracle::make_scene;

/// Load, its rotation in world axes, and vehicles: as the oracle's `change`.
Eigen::VectorXd to_change(const Scene& scene, const Vector3d& load, const Vector3d& turn_L,
                          const Motion& rate) {
  const auto n = static_cast<Eigen::Index>(scene.system.count);
  Eigen::VectorXd change = Eigen::VectorXd::Zero(6 + 3 * n);
  change.segment<3>(0) = load;
  if (scene.system.is_rigid) change.segment<3>(3) = oracle::to_rotation(scene.motion) * turn_L;
  for (Eigen::Index i = 0; i < n; ++i)
    change.segment<3>(6 + 3 * i) = rate.vehicles[static_cast<std::size_t>(i)].v_W;
  return change;
}

Members candidates_of(const Scene& scene) {
  Members candidates;
  for (std::size_t i = 0; i < scene.system.count; ++i)
    if (scene.at_length[i]) candidates.add(i);
  return candidates;
}

/// Calls `test` for random scenes of 1 to 6 vehicles with a point load and a rigid load.
template <class Test>
void for_each_scene(int scenes, bool keeps_length, const Test& test) {
  std::mt19937 random(1);
  for (std::size_t count = 1; count <= 6; ++count)
    for (const bool is_rigid : {false, true})
      for (int k = 0; k < scenes; ++k) {
        SCOPED_TRACE(testing::Message() << count << " vehicles, scene " << k);
        test(make_scene(random, count, is_rigid, keeps_length));
        if (testing::Test::HasFatalFailure()) return;
      }
}

// The second formulation solves systems of condition 1e4; rounding 1e-16 becomes 1e-12.
constexpr double kRelative = 1e-11;

TEST(CablesMechanicsTest, AcceleratesAsTheSecondFormulation) {
  int mixed = 0;
  double largest = 0.0;
  for_each_scene(100, true, [&](const Scene& scene) {
    const oracle::Equations equations(scene.system, scene.motion, scene.actions);
    const auto wanted =
        oracle::solve(equations, equations.force, -equations.speed_terms, scene.at_length);
    ASSERT_TRUE(wanted);
    Geometry geometry;
    calc_geometry(scene.system, scene.motion, Members::all(scene.system.count), geometry);
    const Members candidates =
        find_candidates(Members::all(scene.system.count), geometry, 1e-9, 1e-9);
    ASSERT_EQ(candidates, candidates_of(scene));
    const Accelerations got =
        calc_accelerations(scene.system, scene.motion, geometry, scene.actions, candidates);
    const Eigen::VectorXd change = to_change(scene, got.rate.v_WL, got.rate.w_WL_L, got.rate);
    // The oracle's rotation of a rigid load is ω̇ in W, which is R Ω̇.
    const double error = (change - wanted->change).norm() / wanted->change.norm();
    EXPECT_LE(error, kRelative);
    largest = std::max(largest, error);
    for (std::size_t i = 0; i < scene.system.count; ++i) {
      EXPECT_EQ(got.taut.has(i), wanted->pulls[i]);
      EXPECT_NEAR(got.tension[i], wanted->pull[static_cast<Eigen::Index>(i)],
                  kRelative * wanted->pull.norm());
    }
    mixed += got.taut.size() > 0 && got.taut.size() < scene.system.count;
  });
  note("largest_relative_error", largest);
  EXPECT_GT(mixed, 400) << "scenes without both taut and slack cables say less";
}

TEST(CablesMechanicsTest, HitsAsTheSecondFormulation) {
  double largest = 0.0;
  for_each_scene(100, false, [&](const Scene& scene) {
    const oracle::Equations equations(scene.system, scene.motion, scene.actions);
    // ½ d(l²)/dt = l l̇ bounds the way of the ends.
    Eigen::VectorXd limit = -equations.rows * equations.velocity;
    for (std::size_t i = 0; i < scene.system.count; ++i) {
      const Vehicle& vehicle = scene.motion.vehicles[i];
      limit[static_cast<Eigen::Index>(i)] += vehicle.length * vehicle.length_rate;
    }
    const auto wanted = oracle::solve(equations, Eigen::VectorXd::Zero(equations.force.size()),
                                      limit, scene.at_length);
    ASSERT_TRUE(wanted);
    Motion after = scene.motion;
    const Vector impulses = apply_impact(scene.system, 0.0, candidates_of(scene), after);
    const Eigen::VectorXd change =
        to_change(scene, after.v_WL - scene.motion.v_WL, after.w_WL_L - scene.motion.w_WL_L,
                  after) -
        to_change(scene, Vector3d::Zero(), Vector3d::Zero(), scene.motion);
    const double error = (change - wanted->change).norm() / equations.velocity.norm();
    EXPECT_LE(error, kRelative);
    largest = std::max(largest, error);
    for (std::size_t i = 0; i < scene.system.count; ++i)
      EXPECT_NEAR(impulses[i], wanted->pull[static_cast<Eigen::Index>(i)], kRelative * 10.0);
  });
  note("largest_relative_error", largest);
}

struct Conserved {
  Vector3d linear = Vector3d::Zero(), angular = Vector3d::Zero();  // about the origin
  double energy = 0.0;                                             // kinetic
};

Conserved calc_conserved(const System& system, const Motion& motion) {
  Conserved sum;
  const auto add_point = [&](double mass, const Vector3d& p, const Vector3d& v) {
    sum.linear += mass * v;
    sum.angular += mass * p.cross(v);
    sum.energy += 0.5 * mass * v.squaredNorm();
  };
  add_point(system.load_mass, motion.p_WL, motion.v_WL);
  if (system.is_rigid) {
    sum.angular += oracle::to_rotation(motion) * (system.inertia_L * motion.w_WL_L);
    sum.energy += 0.5 * motion.w_WL_L.dot(system.inertia_L * motion.w_WL_L);
  }
  for (std::size_t i = 0; i < system.count; ++i)
    add_point(system.vehicle_mass[i], motion.vehicles[i].p_W, motion.vehicles[i].v_W);
  return sum;
}

TEST(CablesMechanicsTest, KeepsMomentumAndNeverGainsEnergyInRandomImpacts) {
  const char* wanted = std::getenv("SLS_IMPACTS");  // 10^6 take a minute
  const int impacts = wanted ? std::atoi(wanted) : 10'000;
  std::mt19937 random(2);
  std::uniform_real_distribution<double> share(0.0, 1.0);
  double most = 0.0;
  for (int k = 0; k < impacts; ++k) {
    const auto count = 1 + static_cast<std::size_t>(k % 16);
    Scene scene = make_scene(random, count, k % 3 != 0, false);
    for (Vehicle& vehicle : scene.motion.vehicles) vehicle.length_rate = 0.0;
    const double restitution = k % 2 == 0 ? 0.0 : share(random);
    const Members candidates = candidates_of(scene);
    Motion after = scene.motion;
    const Vector impulses = apply_impact(scene.system, restitution, candidates, after);

    const Conserved a = calc_conserved(scene.system, scene.motion),
                    b = calc_conserved(scene.system, after);
    double size = 0.0;  // of the momenta that were exchanged
    for (std::size_t i = 0; i < count; ++i)
      size += scene.system.vehicle_mass[i] * scene.motion.vehicles[i].v_W.norm() + impulses[i];
    ASSERT_LE((b.linear - a.linear).norm(), 1e-13 * size) << "impact " << k;
    ASSERT_LE((b.angular - a.angular).norm(), 1e-13 * 4.0 * size) << k;  // arms up to 4 m
    ASSERT_LE(b.energy, a.energy * (1.0 + 1e-14 * count)) << k;
    Geometry geometry;
    calc_geometry(scene.system, after, candidates, geometry);
    for (const std::size_t i : candidates) {
      ASSERT_GE(impulses[i], 0.0) << k;
      ASSERT_LE(geometry.stretch_rate[i], 1e-12 * size) << k;
    }
    most = std::max(most, (b.linear - a.linear).norm() / size);
  }
  note("largest_relative_error_of_momentum", most);
}

TEST(CablesMechanicsTest, ReboundsWithItsRestitutionAndLosesThatShareOfEnergy) {
  std::mt19937 random(3);
  for (const double restitution : {0.3, 1.0}) {
    Scene scene = make_scene(random, 1, true, false);
    scene.at_length = {true};
    Vehicle& vehicle = scene.motion.vehicles[0];
    vehicle.length_rate = 0.0;
    Geometry before, after;
    calc_geometry(scene.system, scene.motion, Members::all(1), before);
    vehicle.v_W -= (3.0 - before.stretch_rate[0]) * before.n_W[0];  // apart by 3 m/s
    Motion motion = scene.motion;
    apply_impact(scene.system, restitution, Members::all(1), motion);
    calc_geometry(scene.system, motion, Members::all(1), after);
    EXPECT_NEAR(after.stretch_rate[0], -3.0 * restitution, 1e-14);
    // The effective mass of the cable is 1 / A, and A is 1 / (velocity per impulse).
    Matrix matrix;
    calc_matrix(scene.system, after, Members::all(1), matrix);
    const double lost = calc_conserved(scene.system, scene.motion).energy -
                        calc_conserved(scene.system, motion).energy;
    EXPECT_NEAR(lost, 0.5 / matrix[0][0] * 9.0 * (1.0 - restitution * restitution), 1e-13);
  }
}

TEST(CablesMechanicsTest, FindsTheOnlySolutionOfEveryComplementarityProblem) {
  // A = D + B Bᵀ of each size; the solution is checked by its definition.
  std::mt19937 random(4);
  std::normal_distribution<double> number;
  for (int k = 0; k < 3000; ++k) {
    const std::size_t size = 1 + static_cast<std::size_t>(k) % kMaxCables;
    Matrix a;
    Vector b;
    std::array<std::array<double, 3>, kMaxCables> arm;
    for (auto& row : arm) row = {number(random), number(random), number(random)};
    for (std::size_t i = 0; i < size; ++i) {
      b[i] = number(random);
      for (std::size_t j = 0; j < size; ++j)
        a[i][j] = (i == j ? 0.1 : 0.0) + arm[i][0] * arm[j][0] + arm[i][1] * arm[j][1] +
                  arm[i][2] * arm[j][2];
    }
    const Members all = Members::all(size);
    const Complementarity solution = solve_complementarity(a, b, all);
    for (std::size_t i = 0; i < size; ++i) {
      double w = b[i];
      for (std::size_t j = 0; j < size; ++j) w += a[i][j] * solution.pull[j];
      ASSERT_GE(solution.pull[i], 0.0);
      ASSERT_GE(w, -1e-12);
      ASSERT_LE(std::abs(w * solution.pull[i]), 1e-11) << "problem " << k;
    }
  }
}

}  // namespace
}  // namespace sls::sim::cables
