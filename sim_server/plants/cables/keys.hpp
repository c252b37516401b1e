/// The scenario keys of the plant `cables`.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "common/config/scenario_keys.hpp"
#include "sim_server/plants/cables/complementarity.hpp"
#include "sim_server/plants/multirotor/airframe_keys.hpp"

namespace sls::sim {

/// A movement of a winch from rest to rest.
struct WinchStageKeys {
  std::int64_t at_ns = 0;     ///< when it begins
  double length = 1.0;        ///< at its end, m
  double rate = 1.0;          ///< largest, m/s
  double acceleration = 1.0;  ///< of the length, m/s²
};

struct WinchKeys {
  double min_length = 0.0, max_length = 0.0;  ///< of the drum, m
  std::vector<WinchStageKeys> stages;         ///< one after the other
};

/// The cable of one vehicle.
struct CableKeys {
  Eigen::Vector3d attachment = Eigen::Vector3d::Zero();  ///< in the load, m
  std::optional<double> distance;                        ///< at the start, m; none: taut
  std::optional<double> alpha, beta;                     ///< at the start; none: of plant.initial
  std::optional<double> alpha_dot, beta_dot;             ///< the same, rad/s
  std::optional<double> stiffness;                       ///< N/m; none: it does not stretch
  double damping = 0.0;                                  ///< of one that stretches, N·s/m
  std::optional<WinchKeys> winch;                        ///< none: a constant length
  std::optional<std::int64_t> release_ns;                ///< when it is cut; none: never
};

struct CablesKeys {
  std::optional<AirframeKeys> airframe;         // of every vehicle; none: point masses
  std::vector<CableKeys> cables;                // of each vehicle; empty: all end at a point load
  std::optional<Eigen::Vector3d> load_inertia;  ///< xx, yy, zz, kg·m²; none: a point
  Eigen::Vector3d load_products = Eigen::Vector3d::Zero();  ///< xy, xz, yz, kg·m²
  std::optional<Eigen::Quaterniond> load_attitude;          ///< at the start; none: level
  Eigen::Vector3d load_rates = Eigen::Vector3d::Zero();     ///< at the start, in the load, rad/s
  double restitution = 0.0;                                 ///< of a cable that becomes taut
  std::optional<double> ground_z;                           ///< m; none: no ground
};

/// Why the keys do not describe the cables of so many vehicles; empty if they do.
std::string find_count_defect(const CablesKeys& keys, std::size_t vehicles);

/// The cable of a vehicle; without a list all are alike.
inline CableKeys get_cable(const CablesKeys& keys, std::size_t vehicle) {
  return keys.cables.empty() ? CableKeys() : keys.cables[vehicle];
}

inline constexpr config::ListRange kCables{1, static_cast<int>(cables::kMaxCables), "cables"};

inline constexpr config::ListRange kWinchStages{1, 1000, "stages"};

template <class Map>
void describe(Map& map, WinchStageKeys& stage) {
  using config::kPositive, config::kRequired;
  map.key(kRequired, "at_s", stage.at_ns, config::kNotNegative);
  map.key(kRequired, "length_m", stage.length, kPositive);
  map.key(kRequired, "rate_m_s", stage.rate, kPositive);
  map.key(kRequired, "acceleration_m_s2", stage.acceleration, kPositive);
}

template <class Map>
void describe(Map& map, WinchKeys& winch) {
  using config::kPositive, config::kRequired;
  map.key(kRequired, "min_length_m", winch.min_length, kPositive);
  map.key(kRequired, "max_length_m", winch.max_length, kPositive);
  map.key(kRequired, "stages", winch.stages, kWinchStages);
}

template <class Map>
void describe(Map& map, CableKeys& cable) {
  using config::kOptional;
  map.key(kOptional, "attachment_m", cable.attachment);
  map.key(kOptional, "distance_m", cable.distance, config::kPositive);
  map.key(kOptional, "alpha_rad", cable.alpha, config::kFullTurn);
  map.key(kOptional, "beta_rad", cable.beta, config::kHalfTurn);
  map.key(kOptional, "alpha_dot_rad_s", cable.alpha_dot, config::kFinite);
  map.key(kOptional, "beta_dot_rad_s", cable.beta_dot, config::kFinite);
  map.key(kOptional, "stiffness_n_per_m", cable.stiffness, config::kPositive);
  map.key(kOptional, "damping_n_s_m", cable.damping, config::kNotNegative);
  map.key(kOptional, "winch", cable.winch);
  map.key(kOptional, "release_s", cable.release_ns, config::kPositive);
}

/// The keys that `multirotor` has, too. `rotors` decides: with them vehicles are rigid bodies.
template <class Map>
void describe_airframe(Map& map, std::optional<AirframeKeys>& airframe) {
  using config::kOptional;
  std::optional<std::vector<RotorKeys>> rotors;
  std::optional<RotorNumbers<double>> rotor;
  std::optional<Eigen::Vector3d> inertia, products, torque;
  if (airframe) {
    rotors = airframe->rotors;
    rotor = airframe->rotor;
    inertia = airframe->inertia;
    products = airframe->products;
    torque = airframe->disturbance_torque;
  }
  map.key(kOptional, "rotors", rotors, kRotors);
  const config::Presence presence = rotors ? config::kRequired : kOptional;
  map.key(presence, "rotor", rotor);
  map.key(presence, "inertia_kg_m2", inertia, config::kPositive);
  map.key(kOptional, "inertia_products_kg_m2", products);
  map.key(kOptional, "disturbance_torque_n_m", torque);
  if (!rotors) return;
  const Eigen::Vector3d none = Eigen::Vector3d::Zero();
  airframe.emplace();
  airframe->rotors = *rotors;
  airframe->rotor = rotor.value_or(airframe->rotor);
  airframe->inertia = inertia.value_or(none);
  airframe->products = products.value_or(none);
  airframe->disturbance_torque = torque.value_or(none);
}

template <class Map>
void describe_own(Map& map, config::Plant& plant, CablesKeys& keys) {
  using config::kOptional;
  map.key(kOptional, "cables", keys.cables, kCables);
  map.key(kOptional, "load_inertia_kg_m2", keys.load_inertia, config::kPositive);
  map.key(kOptional, "load_inertia_products_kg_m2", keys.load_products);
  map.key(kOptional, "load_attitude", keys.load_attitude);
  map.key(kOptional, "load_rates_rad_s", keys.load_rates);
  map.key(kOptional, "restitution", keys.restitution, config::kProbability);
  map.key(kOptional, "ground_z_m", keys.ground_z, config::kFinite);
  describe_airframe(map, keys.airframe);
  config::describe_point_mass_loads(map, plant);
}

}  // namespace sls::sim
