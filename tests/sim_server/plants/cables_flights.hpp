/// Systems with cables for tests, and flights that note what happened.
#pragma once

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <sstream>
#include <utility>
#include <vector>

#include "sim_server/plants/cables/hybrid_motion.hpp"

namespace sls::sim::cables {

using Eigen::Vector3d;
inline constexpr double kPi = 3.141592653589793;

/// Vehicles of 1.5 kg and a point load of 0.5 kg, on cables of 1 m.
inline System make_system(std::size_t count = 1) {
  System system;
  system.count = count;
  system.load_mass = 0.5;
  system.gravity = 9.8;
  for (std::size_t i = 0; i < count; ++i) {
    system.vehicle_mass[i] = 1.5;
    system.attachment_L[i].setZero();
  }
  return system;
}

/// A load at the origin at rest.
inline Motion make_motion() {
  Motion motion;
  motion.p_WL.setZero();
  motion.v_WL.setZero();
  motion.q_WL = {1.0, 0.0, 0.0, 0.0};
  motion.w_WL_L.setZero();
  for (Vehicle& vehicle : motion.vehicles) vehicle = {Vector3d::Zero(), Vector3d::Zero(), 1.0, 0.0};
  return motion;
}

inline Actions make_actions(const Vector3d& force) {
  Actions actions;
  actions.f_Q_W.fill(force);
  return actions;
}

/// An event with the time since the flight's start.
struct Flight {
  Flight(const System& system, const Motion& start) : motion(system, start) {}

  void fly(const Actions& actions, double duration, double h = 0.001) {
    std::vector<Event> events;
    const auto steps = static_cast<int>(std::lround(duration / h));
    for (int k = 0; k < steps; ++k, ++flown) {
      events.clear();
      motion.step(actions, h, events);
      for (Event& event : events) {
        event.time += flown * h;
        happened.push_back(event);
      }
    }
  }
  Vector3d to_load() const { return motion.motion().p_WL - motion.motion().vehicles[0].p_W; }

  HybridMotion motion;
  std::vector<Event> happened;
  int flown = 0;
};

inline void expect(const std::vector<Event>& events,
                   std::vector<std::pair<double, Event::Kind>> wanted, double tolerance) {
  ASSERT_EQ(events.size(), wanted.size());
  for (std::size_t i = 0; i < events.size(); ++i) {
    EXPECT_NEAR(events[i].time, wanted[i].first, tolerance) << "event " << i;
    EXPECT_EQ(events[i].kind, wanted[i].second) << "event " << i;
  }
}

/// `count` vehicles on a ring above a load, whose cables lean outwards by `angle`.
inline Motion make_ring(const System& system, double angle) {
  Motion motion = make_motion();
  for (std::size_t i = 0; i < system.count; ++i) {
    const double at = 2.0 * kPi * static_cast<double>(i) / static_cast<double>(system.count);
    motion.vehicles[i].p_W =
        system.attachment_L[i] +
        Vector3d(std::sin(angle) * std::cos(at), std::sin(angle) * std::sin(at), -std::cos(angle));
  }
  return motion;
}

inline System make_plate(std::size_t count) {
  System system = make_system(count);
  system.is_rigid = true;
  system.inertia_L = Vector3d(6e-3, 6e-3, 0.012).asDiagonal();
  system.inverse_inertia_L = system.inertia_L.inverse();
  for (std::size_t i = 0; i < count; ++i) {
    const double at = 2.0 * kPi * static_cast<double>(i) / static_cast<double>(count);
    system.attachment_L[i] = {0.3 * std::cos(at), 0.3 * std::sin(at), -0.01};
  }
  return system;
}

/// Into the test's report, for docs/results.md.
inline void note(const char* name, double number) {
  std::ostringstream text;
  text << number;
  testing::Test::RecordProperty(name, text.str());
}

/// Kinetic and potential energy, J.
inline double calc_energy(const System& system, const Motion& motion) {
  double energy =
      system.load_mass * (0.5 * motion.v_WL.squaredNorm() - system.gravity * motion.p_WL.z());
  if (system.is_rigid) energy += 0.5 * motion.w_WL_L.dot(system.inertia_L * motion.w_WL_L);
  for (std::size_t i = 0; i < system.count; ++i) {
    const Vehicle& vehicle = motion.vehicles[i];
    energy += system.vehicle_mass[i] *
              (0.5 * vehicle.v_W.squaredNorm() - system.gravity * vehicle.p_W.z());
  }
  return energy;
}

}  // namespace sls::sim::cables
