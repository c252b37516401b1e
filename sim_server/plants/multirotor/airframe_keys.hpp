/// The scenario keys of a rigid body with rotors, for every plant that flies one.
#pragma once

#include <array>
#include <optional>
#include <vector>

#include "common/config/scenario_keys.hpp"

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
  double thrust_scale = 1.0;                ///< true thrust per believed thrust
  RotorNumbers<std::optional<double>> own;  ///< overrides of `plant.rotor`
};

/// A rigid body fixed to the airframe.
struct FixedBodyKeys {
  double mass = 0.0;                                   ///< kg
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  ///< of its centre of mass, in B, m
  Eigen::Vector3d inertia = Eigen::Vector3d::Zero();   ///< about it, principal axes of B, kg·m²
};

struct AirframeKeys {
  Eigen::Vector3d inertia = Eigen::Vector3d::Zero();   ///< xx, yy, zz of the bare airframe, kg·m²
  Eigen::Vector3d products = Eigen::Vector3d::Zero();  ///< xy, xz, yz entries of the tensor, kg·m²
  RotorNumbers<double> rotor;
  std::vector<RotorKeys> rotors;
  std::vector<FixedBodyKeys> bodies;
  Eigen::Vector3d disturbance_torque = Eigen::Vector3d::Zero();  ///< constant, in W, N·m
};

inline constexpr config::ListRange kRotors{1, 28, "rotors"};  // their signals fit in a sample

/// The shape of a body with these rotors whose load hangs at `attachment` (in B, m).
config::VehicleShape make_shape(const std::vector<RotorKeys>& rotors,
                                const Eigen::Vector3d& attachment);

/// Inertias are those of rigid bodies, and each rotor has an axis and a range of speeds.
/// @throws ConfigError, as the next two.
void check_airframe(const AirframeKeys& keys, const config::Places& places);
/// The body of `quad_mass` (kg) has an inertia about every axis.
void check_inertia(const AirframeKeys& keys, double quad_mass, const config::Places& places);
/// The signals of `rotors` fit in a measurement beside `others` of the plant, which are those of
/// `beside`, and those of air and thrust.
void check_rotor_signals(const config::Scenario& scenario, std::size_t rotors, std::size_t others,
                         const std::string& beside, const config::Places& places);
/// The rotors can lift `weight` (N) of `lifted`.
void check_lift(const AirframeKeys& keys, double weight, const std::string& lifted,
                const config::Places& places);

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
  map.key(config::kOptional, "thrust_scale", rotor.thrust_scale, config::kNotNegative);
  describe_numbers(map, config::kOptional, rotor.own);
}

template <class Map>
void describe(Map& map, FixedBodyKeys& body) {
  map.key(config::kRequired, "mass_kg", body.mass, config::kPositive);
  map.key(config::kOptional, "position_m", body.position);
  map.key(config::kOptional, "inertia_kg_m2", body.inertia, config::kNotNegative);
}

}  // namespace sls::sim
