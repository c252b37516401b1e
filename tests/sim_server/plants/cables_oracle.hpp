/// A second formulation of the mechanics of cables, and random systems. Everything is in world
/// axes; a constraint is ½(d·d − l²) = 0 with the vector d from vehicle to attachment, and all
/// accelerations and multipliers are solved for together. Every set of pulling cables is tried.
#pragma once

#include <Eigen/Dense>
#include <optional>
#include <random>
#include <vector>

#include "sim_server/plants/cables/mechanics.hpp"

namespace sls::sim::cables::oracle {

using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

inline Matrix3d to_rotation(const Motion& motion) {
  const Eigen::Vector4d& q = motion.q_WL;
  return Eigen::Quaterniond(q[0], q[1], q[2], q[3]).normalized().toRotationMatrix();
}

inline Matrix3d cross_matrix(const Vector3d& v) {
  Matrix3d m;
  m << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return m;
}

/// Masses, constraint rows and forces in the order: load, its rotation, vehicles.
struct Equations {
  Equations(const System& system, const Motion& motion, const Actions& actions) {
    const auto n = static_cast<Eigen::Index>(system.count);
    const Matrix3d R = to_rotation(motion);
    const Vector3d w = R * motion.w_WL_L;
    const Matrix3d inertia = system.is_rigid ? Matrix3d(R * system.inertia_L * R.transpose())
                                             : Matrix3d(Matrix3d::Identity());
    const Vector3d down(0.0, 0.0, system.gravity);
    mass = MatrixXd::Zero(6 + 3 * n, 6 + 3 * n);
    force = velocity = VectorXd::Zero(6 + 3 * n);
    rows = MatrixXd::Zero(n, 6 + 3 * n);
    speed_terms = distance = VectorXd::Zero(n);
    mass.block<3, 3>(0, 0) = system.load_mass * Matrix3d::Identity();
    mass.block<3, 3>(3, 3) = inertia;
    force.segment<3>(0) = system.load_mass * down;
    velocity.segment<3>(0) = motion.v_WL;
    if (system.is_rigid) {
      force.segment<3>(3) = -w.cross(inertia * w);
      velocity.segment<3>(3) = w;
    }
    for (Eigen::Index i = 0; i < n; ++i) {
      const auto at = static_cast<std::size_t>(i);
      const Vehicle& vehicle = motion.vehicles[at];
      const double m = system.vehicle_mass[at];
      mass.block<3, 3>(6 + 3 * i, 6 + 3 * i) = m * Matrix3d::Identity();
      force.segment<3>(6 + 3 * i) = m * down + actions.f_Q_W[at];
      velocity.segment<3>(6 + 3 * i) = vehicle.v_W;
      const Vector3d r = system.is_rigid ? Vector3d(R * system.attachment_L[at]) : Vector3d::Zero();
      const Vector3d d = motion.p_WL + r - vehicle.p_W;
      const Vector3d d_dot = motion.v_WL + velocity.segment<3>(3).cross(r) - vehicle.v_W;
      rows.block<1, 3>(i, 0) = d.transpose();
      if (system.is_rigid) rows.block<1, 3>(i, 3) = -d.transpose() * cross_matrix(r);
      rows.block<1, 3>(i, 6 + 3 * i) = -d.transpose();
      // d²/dt² ½ l² = l̇² + l l̈
      speed_terms[i] = d_dot.squaredNorm() +
                       d.dot(velocity.segment<3>(3).cross(d_dot - motion.v_WL + vehicle.v_W)) -
                       vehicle.length_rate * vehicle.length_rate -
                       vehicle.length * actions.length_acceleration[at];
      distance[i] = d.norm();
    }
  }

  MatrixXd mass, rows;
  VectorXd force, velocity, speed_terms, distance;
};

/// Accelerations or changes of velocity, and the multipliers of all cables times their distance.
struct Solution {
  VectorXd change, pull;
  std::vector<bool> pulls;
};

/// Solves mass × change = `force` − rowsᵀ κ and rows × change ≤ `limit`, κ ≥ 0, one of them equal,
/// for the cables `at_length`. Empty if no set of pulling cables satisfies all signs.
inline std::optional<Solution> solve(const Equations& equations, const VectorXd& force,
                                     const VectorXd& limit, const std::vector<bool>& at_length) {
  const Eigen::Index n = equations.rows.rows(), size = equations.mass.rows();
  for (unsigned set = 0; set < 1u << n; ++set) {
    std::vector<Eigen::Index> pulling;
    bool is_possible = true;
    for (Eigen::Index i = 0; i < n; ++i)
      if (set >> i & 1u) {
        is_possible = is_possible && at_length[static_cast<std::size_t>(i)];
        pulling.push_back(i);
      }
    if (!is_possible) continue;
    const auto k = static_cast<Eigen::Index>(pulling.size());
    MatrixXd kkt = MatrixXd::Zero(size + k, size + k);
    VectorXd right = VectorXd::Zero(size + k);
    kkt.topLeftCorner(size, size) = equations.mass;
    right.head(size) = force;
    for (Eigen::Index j = 0; j < k; ++j) {
      kkt.block(size + j, 0, 1, size) = equations.rows.row(pulling[static_cast<std::size_t>(j)]);
      kkt.block(0, size + j, size, 1) = kkt.block(size + j, 0, 1, size).transpose();
      right[size + j] = limit[pulling[static_cast<std::size_t>(j)]];
    }
    const VectorXd solved = kkt.fullPivLu().solve(right);
    Solution solution{solved.head(size), VectorXd::Zero(n), std::vector<bool>(at_length.size())};
    for (Eigen::Index j = 0; j < k; ++j) {
      const Eigen::Index i = pulling[static_cast<std::size_t>(j)];
      solution.pull[i] = solved[size + j] * equations.distance[i];
      solution.pulls[static_cast<std::size_t>(i)] = true;
    }
    const VectorXd excess = equations.rows * solution.change - limit;
    bool is_right = solution.pull.size() == 0 || solution.pull.minCoeff() >= 0.0;
    for (Eigen::Index i = 0; i < n; ++i)
      if (at_length[static_cast<std::size_t>(i)] && !(set >> i & 1u)) is_right &= excess[i] <= 0.0;
    if (is_right) return solution;
  }
  return {};
}

/// A load, its attitude, and vehicles around and above it. Cables of `taut` are at their length, at
/// rates that keep it; the others are shorter.
struct Scene {
  System system;
  Motion motion;
  Actions actions;
  std::vector<bool> at_length;
};

inline Scene make_scene(std::mt19937& random, std::size_t count, bool is_rigid, bool keeps_length) {
  std::uniform_real_distribution<double> any(-1.0, 1.0), positive(0.2, 2.0);
  const auto vector = [&] { return Vector3d(any(random), any(random), any(random)); };
  Scene scene;
  System& system = scene.system;
  system.count = count;
  system.load_mass = positive(random);
  system.gravity = 9.8;
  system.is_rigid = is_rigid;
  if (is_rigid) {
    // The inertia of six points.
    system.inertia_L = Matrix3d::Zero();
    for (int i = 0; i < 6; ++i) {
      const Matrix3d of_point = cross_matrix(0.3 * vector());
      system.inertia_L -= of_point * of_point;
    }
    system.inverse_inertia_L = system.inertia_L.inverse();
  }
  Motion& motion = scene.motion;
  motion.p_WL = vector();
  motion.v_WL = 2.0 * vector();
  motion.q_WL =
      is_rigid ? Eigen::Vector4d(any(random), any(random), any(random), any(random)).normalized()
               : Eigen::Vector4d(1, 0, 0, 0);
  motion.w_WL_L = is_rigid ? Vector3d(3.0 * vector()) : Vector3d::Zero();
  const Matrix3d R = to_rotation(motion);
  for (std::size_t i = 0; i < count; ++i) {
    system.vehicle_mass[i] = positive(random);
    system.attachment_L[i] = is_rigid ? Vector3d(0.3 * vector()) : Vector3d::Zero();
    scene.actions.f_Q_W[i] = 10.0 * vector() - Vector3d(0, 0, 10.0 * positive(random));
    scene.actions.length_acceleration[i] = any(random);
    Vehicle& vehicle = motion.vehicles[i];
    vehicle.length = positive(random);
    vehicle.length_rate = 0.3 * any(random);
    vehicle.v_W = 2.0 * vector();
    scene.at_length.push_back(any(random) > -0.5);
    const double share = scene.at_length[i] ? 1.0 : 0.5 + 0.4 * any(random);
    const Vector3d n = (vector() + Vector3d(0, 0, 1)).normalized();
    const Vector3d r = R * system.attachment_L[i];
    vehicle.p_W = motion.p_WL + r - share * vehicle.length * n;
    if (!keeps_length) continue;
    const Vector3d drift = motion.v_WL + (R * motion.w_WL_L).cross(r) - vehicle.v_W;
    vehicle.v_W += n * (n.dot(drift) - vehicle.length_rate);
  }
  return scene;
}

}  // namespace sls::sim::cables::oracle
