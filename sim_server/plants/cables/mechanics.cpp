#include "sim_server/plants/cables/mechanics.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

#include "common/model/dot.hpp"
#include "common/model/forces.hpp"

namespace sls::sim::cables {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

/// ½ q ∘ (0, w).
Eigen::Vector4d calc_quaternion_rate(const Eigen::Vector4d& q, const Vector3d& w) {
  const Vector3d vector = q.tail<3>();
  Eigen::Vector4d rate;
  rate[0] = -0.5 * model::dot(vector, w);
  rate.tail<3>() = 0.5 * (q[0] * w + vector.cross(w));
  return rate;
}

Vector3d calc_drag(const Actions& actions, const Vehicle& vehicle, std::size_t i) {
  model::Aerodynamics air = actions.air;
  if (actions.v_wind_W) air.v_wind_W = (*actions.v_wind_W)[i];
  return model::calc_rotor_drag(actions.f_Q_W[i], vehicle.v_W, air);
}

/// Of a body that stands on the ground: see hold_still().
bool stands(double mass) { return std::isinf(mass); }

}  // namespace

// Between the stages of a step a quaternion has another length than 1.
Matrix3d calc_rotation(const Eigen::Vector4d& q) {
  const double scale = 2.0 / q.squaredNorm();
  const double w = q[0], x = q[1], y = q[2], z = q[3];
  Matrix3d rotation;
  rotation << 1.0 - scale * (y * y + z * z), scale * (x * y - w * z), scale * (x * z + w * y),
      scale * (x * y + w * z), 1.0 - scale * (x * x + z * z), scale * (y * z - w * x),
      scale * (x * z - w * y), scale * (y * z + w * x), 1.0 - scale * (x * x + y * y);
  return rotation;
}

System hold_still(const System& system, const Members& standing) {
  System held = system;
  for (const std::size_t body : standing)
    (body == kLoad ? held.load_mass : held.vehicle_mass[body]) =
        std::numeric_limits<double>::infinity();
  if (standing.has(kLoad)) held.inverse_inertia_L.setZero();
  return held;
}

void add(const System& system, const Motion& start, double h, const Motion& rate, Motion& sum) {
  sum.p_WL = start.p_WL + h * rate.p_WL;
  sum.v_WL = start.v_WL + h * rate.v_WL;
  sum.q_WL = start.q_WL;
  sum.w_WL_L = start.w_WL_L;
  if (system.is_rigid) {
    sum.q_WL += h * rate.q_WL;
    sum.w_WL_L += h * rate.w_WL_L;
  }
  for (std::size_t i = 0; i < system.count; ++i) {
    const Vehicle &from = start.vehicles[i], &change = rate.vehicles[i];
    Vehicle& to = sum.vehicles[i];
    to.p_W = from.p_W + h * change.p_W;
    to.v_W = from.v_W + h * change.v_W;
    to.length = from.length + h * change.length;
    to.length_rate = from.length_rate + h * change.length_rate;
  }
  if (!system.has_attitude) return;
  for (std::size_t i = 0; i < system.count; ++i) {
    sum.turns[i].q_WB = start.turns[i].q_WB + h * rate.turns[i].q_WB;
    sum.turns[i].w_WB_B = start.turns[i].w_WB_B + h * rate.turns[i].w_WB_B;
  }
}

void calc_geometry(const System& system, const Motion& motion, const Members& cables,
                   Geometry& geometry) {
  if (system.is_rigid) geometry.R_WL = calc_rotation(motion.q_WL);
  const Matrix3d& R_WL = geometry.R_WL;
  for (const std::size_t i : cables) {
    const Vehicle& vehicle = motion.vehicles[i];
    Vector3d to_attachment = motion.p_WL - vehicle.p_W, drift = motion.v_WL - vehicle.v_W;
    if (system.is_rigid) {
      const Vector3d& arm_L = system.attachment_L[i];
      to_attachment += R_WL * arm_L;
      drift += R_WL * motion.w_WL_L.cross(arm_L);
    }
    // Eq. (2).
    const double distance = std::sqrt(to_attachment.squaredNorm());
    const double inverse = distance > 0.0 ? 1.0 / distance : 0.0;
    const Vector3d n_W = inverse * to_attachment;
    const double away = model::dot(n_W, drift);
    geometry.n_W[i] = n_W;
    geometry.stretch[i] = distance - vehicle.length;
    geometry.stretch_rate[i] = away - vehicle.length_rate;
    geometry.bend[i] = (drift - away * n_W).squaredNorm() * inverse;
    if (system.is_rigid) {
      geometry.moment_L[i] = system.attachment_L[i].cross(R_WL.transpose() * n_W);
      geometry.turn_L[i] = system.inverse_inertia_L * geometry.moment_L[i];
    }
  }
}

void calc_matrix(const System& system, const Geometry& geometry, const Members& cables,
                 Matrix& matrix) {
  const double inverse_mass = 1.0 / system.load_mass;
  for (std::size_t row = 0; row < cables.size(); ++row) {
    const std::size_t i = cables[row];
    for (std::size_t column = 0; column <= row; ++column) {
      const std::size_t j = cables[column];
      double element = inverse_mass * model::dot(geometry.n_W[i], geometry.n_W[j]);
      if (system.is_rigid) element += model::dot(geometry.moment_L[i], geometry.turn_L[j]);
      if (i == j) element += 1.0 / system.vehicle_mass[i];
      matrix[i][j] = matrix[j][i] = element;
    }
  }
}

Vector3d calc_force(const Actions& actions, const Vehicle& vehicle, std::size_t i) {
  Vector3d force = actions.f_Q_W[i] + actions.disturbance_W;
  if (actions.air.rotor_drag != 0.0) force += calc_drag(actions, vehicle, i);
  return force;
}

void calc_free_rate(const System& system, const Motion& motion, const Actions& actions,
                    Motion& rate) {
  rate.p_WL = motion.v_WL;
  rate.v_WL = {0.0, 0.0, stands(system.load_mass) ? 0.0 : system.gravity};
  if (actions.load_drag.acts())
    rate.v_WL += model::calc_load_drag(motion.v_WL, actions.load_wind_W, actions.load_drag) /
                 system.load_mass;
  if (system.is_rigid) {
    const Vector3d& w = motion.w_WL_L;
    rate.q_WL = calc_quaternion_rate(motion.q_WL, w);
    rate.w_WL_L = system.inverse_inertia_L * (system.inertia_L * w).cross(w);
  }
  for (std::size_t i = 0; i < system.count; ++i) {
    const Vehicle& vehicle = motion.vehicles[i];
    Vehicle& change = rate.vehicles[i];
    change.p_W = vehicle.v_W;
    change.v_W = calc_force(actions, vehicle, i) / system.vehicle_mass[i];
    if (!stands(system.vehicle_mass[i])) change.v_W.z() += system.gravity;
    change.length = vehicle.length_rate;
    change.length_rate = actions.length_acceleration[i];
  }
  if (!system.has_attitude) return;
  for (std::size_t i = 0; i < system.count; ++i) {
    const auto& [q_WB, w] = motion.turns[i];
    Turn& change = rate.turns[i];
    if (stands(system.vehicle_mass[i])) {
      change.q_WB.setZero();
      change.w_WB_B.setZero();
      continue;
    }
    // Eq. (16).
    change.q_WB = calc_quaternion_rate(q_WB, w);
    change.w_WB_B = system.inverse_vehicle_inertia_B *
                    (actions.torque_B[i] + (system.vehicle_inertia_B * w).cross(w));
  }
}

void calc_offset(const System& system, const Motion& motion, const Geometry& geometry,
                 const Actions& actions, const Motion& free_rate, const Members& cables,
                 Vector& offset) {
  for (const std::size_t i : cables) {
    double apart = model::dot(geometry.n_W[i], free_rate.v_WL - free_rate.vehicles[i].v_W) +
                   geometry.bend[i] - actions.length_acceleration[i];
    if (system.is_rigid) {
      const Vector3d& w = motion.w_WL_L;
      const Vector3d inward_L = w.cross(w.cross(system.attachment_L[i]));
      apart += model::dot(geometry.moment_L[i], free_rate.w_WL_L) +
               model::dot(geometry.n_W[i], geometry.R_WL * inward_L);
    }
    offset[i] = -apart;
  }
}

double calc_power(const System& system, const Motion& motion, const Motion& rate) {
  double power = system.load_mass * model::dot(motion.v_WL, rate.v_WL);
  if (system.is_rigid) power += model::dot(motion.w_WL_L, Vector3d(system.inertia_L * rate.w_WL_L));
  for (std::size_t i = 0; i < system.count; ++i)
    power += system.vehicle_mass[i] * model::dot(motion.vehicles[i].v_W, rate.vehicles[i].v_W);
  return power;
}

double calc_kinetic_change(const System& system, const Motion& from, const Motion& to) {
  const auto half_square_change = [](const Vector3d& v, const Vector3d& v_end) {
    return 0.5 * model::dot(Vector3d(v_end - v), Vector3d(v_end + v));
  };
  double change = system.load_mass * half_square_change(from.v_WL, to.v_WL);
  if (system.is_rigid)
    change += 0.5 * model::dot(Vector3d(to.w_WL_L - from.w_WL_L),
                               Vector3d(system.inertia_L * (to.w_WL_L + from.w_WL_L)));
  for (std::size_t i = 0; i < system.count; ++i)
    change += system.vehicle_mass[i] * half_square_change(from.vehicles[i].v_W, to.vehicles[i].v_W);
  return change;
}

double calc_held_work(const System& system, const Actions& actions, const Motion& from,
                      const Motion& to) {
  double work = system.load_mass * system.gravity * (to.p_WL.z() - from.p_WL.z());
  for (std::size_t i = 0; i < system.count; ++i) {
    const Vector3d way = to.vehicles[i].p_W - from.vehicles[i].p_W;
    work += model::dot(Vector3d(actions.f_Q_W[i] + actions.disturbance_W), way) +
            system.vehicle_mass[i] * system.gravity * way.z();
  }
  return work;
}

void add_pulls(const System& system, const Geometry& geometry, const Vector& pulls,
               const Members& cables, Motion& rate) {
  Vector3d on_load = Vector3d::Zero();
  for (const std::size_t i : cables) {
    const Vector3d pull_W = pulls[i] * geometry.n_W[i];
    on_load -= pull_W;
    rate.vehicles[i].v_W += pull_W / system.vehicle_mass[i];
    if (system.is_rigid) rate.w_WL_L -= pulls[i] * geometry.turn_L[i];
  }
  rate.v_WL += on_load / system.load_mass;
}

void add_shifts(const System& system, const Geometry& geometry, const Vector& shifts,
                const Members& cables, Motion& motion) {
  Vector3d of_load = Vector3d::Zero(), turn_L = Vector3d::Zero();
  for (const std::size_t i : cables) {
    const Vector3d along = shifts[i] * geometry.n_W[i];
    motion.vehicles[i].p_W += along / system.vehicle_mass[i];
    of_load -= along;
    if (system.is_rigid) turn_L -= shifts[i] * geometry.turn_L[i];
  }
  motion.p_WL += of_load / system.load_mass;
  if (!system.is_rigid || stands(system.load_mass)) return;
  motion.q_WL += calc_quaternion_rate(motion.q_WL, turn_L);
  motion.q_WL /= std::sqrt(motion.q_WL.squaredNorm());
}

Members find_candidates(const Members& cables, const Geometry& geometry, double tolerance,
                        double rate_tolerance) {
  Members candidates;
  for (const std::size_t i : cables)
    if (geometry.stretch[i] >= -tolerance && geometry.stretch_rate[i] >= -rate_tolerance)
      candidates.add(i);
  return candidates;
}

void add_springs(const System& system, const Geometry& geometry, const Members& stretched,
                 Vector& tension, Motion& rate) {
  for (const std::size_t i : stretched)
    tension[i] =
        system.stiffness[i] * geometry.stretch[i] + system.damping[i] * geometry.stretch_rate[i];
  add_pulls(system, geometry, tension, stretched, rate);
}

Accelerations calc_accelerations(const System& system, const Motion& motion,
                                 const Geometry& geometry, const Actions& actions,
                                 const Members& candidates, const Members& stretched) {
  Accelerations result;
  Vector springs{};
  calc_free_rate(system, motion, actions, result.rate);
  if (!stretched.empty()) add_springs(system, geometry, stretched, springs, result.rate);
  Vector offset;
  calc_offset(system, motion, geometry, actions, result.rate, candidates, offset);
  Matrix matrix;
  calc_matrix(system, geometry, candidates, matrix);
  const Complementarity solution = solve_complementarity(matrix, offset, candidates);
  result.tension = solution.pull;
  result.taut = solution.active;
  add_pulls(system, geometry, result.tension, result.taut, result.rate);
  for (const std::size_t i : stretched) result.tension[i] = springs[i];
  return result;
}

Vector apply_impact(const System& system, double restitution, const Members& candidates,
                    Motion& motion) {
  Vector impulses{};
  Geometry geometry;
  Matrix matrix;
  // A rebound can shorten another cable's way so that it arrives, too: then both meet again. Each
  // time energy is lost; the last time nothing rebounds, which ends it.
  constexpr int kMostRebounds = 100;
  for (int rebounds = 0;; ++rebounds) {
    calc_geometry(system, motion, candidates, geometry);
    if (rebounds == 0) calc_matrix(system, geometry, candidates, matrix);
    Vector offset{};
    double fastest = 0.0, largest = 0.0;
    for (const std::size_t i : candidates) {
      offset[i] = -geometry.stretch_rate[i];
      fastest = std::max(fastest, geometry.stretch_rate[i]);
      largest = std::max(largest, std::abs(geometry.stretch_rate[i]));
    }
    if (rebounds > 0 && fastest <= 1e-14 * largest) return impulses;
    const Complementarity solution = solve_complementarity(matrix, offset, candidates);
    const double share = rebounds < kMostRebounds ? 1.0 + restitution : 1.0;  // eq. (7)
    Vector pulls;
    for (const std::size_t i : solution.active) pulls[i] = share * solution.pull[i];
    for (const std::size_t i : solution.active) impulses[i] += pulls[i];
    add_pulls(system, geometry, pulls, solution.active, motion);
    if (restitution == 0.0 || rebounds == kMostRebounds) return impulses;
  }
}

}  // namespace sls::sim::cables
