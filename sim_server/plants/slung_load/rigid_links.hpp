/// The published links of the `rigid` pendulum, and the values that they require in `vehicle`.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>

#include "common/model/parameters.hpp"

namespace sls::sim {

/// A rigid body below the spherical joint at the quadrotor's centre of mass.
struct RigidLink {
  double mass;        ///< kg
  double distance;    ///< of its centre of mass below the joint, m
  double inertia_xx;  ///< about its centre of mass, kg·m²
  double inertia_yy;  ///< kg·m²
  double inertia_zz;  ///< kg·m², about the rod
  Eigen::Vector3d inertia() const { return {inertia_xx, inertia_yy, inertia_zz}; }
};

inline constexpr double kRigidBaseMass = 1.5;  ///< base link, a point mass here, kg
inline constexpr RigidLink kRigidRod{0.001, 0.5, 8.333e-4, 8.333e-4, 5e-5};
inline constexpr RigidLink kRigidLoad{0.2, 1.1, 8e-4, 8e-4, 8e-4};

/// A key of `vehicle` that contradicts the links, as `rod_length_m` and `expected 1.1 (…), got 1`.
struct RigidContradiction {
  std::string key;
  std::string message;
};

/// The links have fixed masses and a fixed length, so `vehicle` must have quad_mass_kg 1.5,
/// load_mass_kg 0.2 (the load) or 0.201 (load and rod), rod_length_m 1.1. Gravity is free.
std::optional<RigidContradiction> find_rigid_contradiction(
    const model::SlungLoadParameters& vehicle);

/// @throws config::ConfigError `PLACE: vehicle.KEY: expected …, got …` if `vehicle` contradicts the
/// links; an empty `place` is left out.
void check_rigid_vehicle(const model::SlungLoadParameters& vehicle, const std::string& place = "");

}  // namespace sls::sim
