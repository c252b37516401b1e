/// The scenario keys of the plant `multirotor`.
#pragma once

#include <optional>

#include "sim_server/plants/multirotor/airframe_keys.hpp"
#include "sim_server/plants/pendulum.hpp"

namespace sls::sim {

/// The rod of the rigid pendulum.
struct RodKeys {
  double mass = 0.0;                                  ///< kg
  double centre = 0.0;                                ///< of mass, below the joint, m
  Eigen::Vector3d inertia = Eigen::Vector3d::Zero();  ///< about it; z along the rod, kg·m²
};

struct MultirotorKeys : AirframeKeys {
  Pendulum pendulum = Pendulum::kIdeal;
  Eigen::Vector3d attachment = Eigen::Vector3d::Zero();  ///< of the pendulum, in B, m
  std::optional<RodKeys> rod;                            ///< of `rigid`
  std::optional<Eigen::Vector3d> load_inertia;           ///< of `rigid`; z along the rod, kg·m²
};

inline constexpr config::ListRange kFixedBodies{0, 16, "bodies"};

template <class Map>
void describe(Map& map, RodKeys& rod) {
  map.key(config::kRequired, "mass_kg", rod.mass, config::kPositive);
  map.key(config::kRequired, "centre_m", rod.centre, config::kNotNegative);
  map.key(config::kOptional, "inertia_kg_m2", rod.inertia, config::kNotNegative);
}

template <class Map>
void describe_own(Map& map, config::Plant& plant, MultirotorKeys& keys) {
  using config::kNotNegative, config::kOptional, config::kPositive, config::kRequired;
  map.key(kRequired, "inertia_kg_m2", keys.inertia, kPositive);
  map.key(kOptional, "inertia_products_kg_m2", keys.products);
  map.key(kRequired, "rotor", keys.rotor);
  map.key(kRequired, "rotors", keys.rotors, kRotors);
  map.key(kOptional, "bodies", keys.bodies, kFixedBodies);
  map.key(kOptional, "pendulum", keys.pendulum);
  map.key(kOptional, "attachment_m", keys.attachment);
  map.key(kOptional, "rod", keys.rod);
  map.key(kOptional, "load_inertia_kg_m2", keys.load_inertia, kNotNegative);
  map.key(kOptional, "wind_m_s", plant.air.v_wind_W);
  config::describe_surroundings(map, plant);
  map.key(kOptional, "disturbance_n", plant.disturbance_W);
  map.key(kOptional, "disturbance_torque_n_m", keys.disturbance_torque);
}

}  // namespace sls::sim
