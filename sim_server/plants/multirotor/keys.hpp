/// The scenario keys of the plant `multirotor`.
#pragma once

#include <array>
#include <optional>
#include <vector>

#include "common/config/scenario_keys.hpp"
#include "sim_server/plants/pendulum.hpp"

namespace sls::sim {

enum class Spin { kCounterClockwise, kClockwise };
inline std::array<config::Name<Spin>, 2> names_of(Spin) {
  return {{{"ccw", Spin::kCounterClockwise}, {"cw", Spin::kClockwise}}};
}

/// Parameters common to all rotors, or the values that one rotor overrides.
template <class Number>
struct RotorNumbers {
  Number thrust_constant{};    ///< N·s²
  Number torque_constant{};    ///< m
  Number drag_constant{};      ///< N·s²/m
  Number rolling_constant{};   ///< N·s²
  Number min_speed{};          ///< rad/s
  Number max_speed{};          ///< rad/s
  Number lag_up{};             ///< s
  Number lag_down{};           ///< s
  Number thrust_loss_speed{};  ///< axial speed at which no thrust is left, m/s; 0: no loss
};

struct RotorKeys {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  ///< in B, m
  Eigen::Vector3d axis = -Eigen::Vector3d::UnitZ();    ///< of the thrust, in B; any length but 0
  Spin spin = Spin::kCounterClockwise;
  RotorNumbers<std::optional<double>> own;  ///< overrides of `plant.rotor`
};

/// A rigid body fixed to the airframe.
struct FixedBodyKeys {
  double mass = 0.0;                                   ///< kg
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  ///< of its centre of mass, in B, m
  Eigen::Vector3d inertia = Eigen::Vector3d::Zero();   ///< about it, principal axes of B, kg·m²
};

/// The rod of the rigid pendulum.
struct RodKeys {
  double mass = 0.0;                                  ///< kg
  double centre = 0.0;                                ///< of mass, below the joint, m
  Eigen::Vector3d inertia = Eigen::Vector3d::Zero();  ///< about it; z along the rod, kg·m²
};

struct MultirotorKeys {
  Pendulum pendulum = Pendulum::kIdeal;
  Eigen::Vector3d inertia = Eigen::Vector3d::Zero();   ///< xx, yy, zz of the bare airframe, kg·m²
  Eigen::Vector3d products = Eigen::Vector3d::Zero();  ///< xy, xz, yz entries of the tensor, kg·m²
  RotorNumbers<double> rotor;
  std::vector<RotorKeys> rotors;
  std::vector<FixedBodyKeys> bodies;
  Eigen::Vector3d attachment = Eigen::Vector3d::Zero();  ///< of the pendulum, in B, m
  std::optional<RodKeys> rod;                            ///< of `rigid`
  std::optional<Eigen::Vector3d> load_inertia;           ///< of `rigid`; z along the rod, kg·m²
  Eigen::Vector3d disturbance_torque = Eigen::Vector3d::Zero();  ///< constant, in W, N·m
};

inline constexpr config::ListRange kRotors{1, 28, "rotors"};  // their signals fit in a sample
inline constexpr config::ListRange kFixedBodies{0, 16, "bodies"};

template <class Map, class Number>
void describe_numbers(Map& map, config::Presence presence, RotorNumbers<Number>& numbers) {
  using config::kNotNegative, config::kOptional, config::kPositive;
  map.key(presence, "thrust_constant_n_s2", numbers.thrust_constant, kPositive);
  map.key(kOptional, "torque_constant_m", numbers.torque_constant, kNotNegative);
  map.key(kOptional, "drag_constant_n_s2_m", numbers.drag_constant, kNotNegative);
  map.key(kOptional, "rolling_constant_n_s2", numbers.rolling_constant, kNotNegative);
  map.key(kOptional, "min_speed_rad_s", numbers.min_speed, kNotNegative);
  map.key(presence, "max_speed_rad_s", numbers.max_speed, kPositive);
  map.key(kOptional, "lag_up_s", numbers.lag_up, kNotNegative);
  map.key(kOptional, "lag_down_s", numbers.lag_down, kNotNegative);
  map.key(kOptional, "thrust_loss_speed_m_s", numbers.thrust_loss_speed, kNotNegative);
}

template <class Map>
void describe(Map& map, RotorNumbers<double>& numbers) {
  describe_numbers(map, config::kRequired, numbers);
}

template <class Map>
void describe(Map& map, RotorKeys& rotor) {
  map.key(config::kRequired, "position_m", rotor.position);
  map.key(config::kOptional, "axis", rotor.axis);
  map.key(config::kRequired, "spin", rotor.spin);
  describe_numbers(map, config::kOptional, rotor.own);
}

template <class Map>
void describe(Map& map, FixedBodyKeys& body) {
  map.key(config::kRequired, "mass_kg", body.mass, config::kPositive);
  map.key(config::kOptional, "position_m", body.position);
  map.key(config::kOptional, "inertia_kg_m2", body.inertia, config::kNotNegative);
}

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
  map.key(kOptional, "disturbance_n", plant.disturbance_W);
  map.key(kOptional, "disturbance_torque_n_m", keys.disturbance_torque);
}

}  // namespace sls::sim
