/// The scenario keys of the autopilot `px4`. The defaults are those of the published PX4 flight.
#pragma once

#include <optional>
#include <vector>

#include "common/config/scenario_keys.hpp"
#include "sim_server/autopilots/px4/attitude_control.hpp"
#include "sim_server/autopilots/px4/mixer.hpp"
#include "sim_server/autopilots/px4/rate_control.hpp"
#include "sim_server/autopilots/px4/thrust_map.hpp"

namespace sls::sim::px4 {

enum class ThrustMap { kAffine, kExact };
inline std::array<config::Name<ThrustMap>, 2> names_of(ThrustMap) {
  return {{{"affine", ThrustMap::kAffine}, {"exact", ThrustMap::kExact}}};
}

struct Keys {
  ThrustMap thrust_map = ThrustMap::kAffine;
  std::optional<AffineThrust> affine_thrust;  ///< none: the published one
  AttitudeGains attitude;
  RateGains rates;
  std::optional<std::vector<MixerRow>> mixer;  ///< one per rotor; none: from their geometry
  SpeedMap speeds;
};

inline constexpr config::ListRange kMixerRows{1, 64, "rotors"};

template <class Map>
void describe(Map& map, AffineThrust& line) {
  map.key(config::kOptional, "force_n", line.force, config::kNotNegative);
  map.key(config::kOptional, "thrust", line.thrust, config::kProbability);
  map.key(config::kOptional, "force_per_thrust_n", line.force_per_thrust, config::kPositive);
}

template <class Map>
void describe(Map& map, AttitudeGains& gains) {
  map.key(config::kOptional, "gains_per_s", gains.per_rad, config::kNotNegative);
  map.key(config::kOptional, "yaw_weight", gains.yaw_weight, config::kProbability);
  map.key(config::kOptional, "rate_limits_rad_s", gains.rate_limits, config::kPositive);
}

template <class Map>
void describe(Map& map, RateGains& gains) {
  using config::kNotNegative, config::kOptional;
  map.key(kOptional, "proportional_per_rad_s", gains.proportional, kNotNegative);
  map.key(kOptional, "integral_per_rad", gains.integral, kNotNegative);
  map.key(kOptional, "derivative_per_rad_s2", gains.derivative, kNotNegative);
  map.key(kOptional, "integral_limits", gains.integral_limits, kNotNegative);
  map.key(kOptional, "integral_off_error_rad_s", gains.integral_off_error, config::kPositive);
  map.key(kOptional, "rate_cut_off_hz", gains.rate_cut_off, kNotNegative);
  map.key(kOptional, "derivative_cut_off_hz", gains.derivative_cut_off, kNotNegative);
}

template <class Map>
void describe(Map& map, MixerRow& row) {
  map.key(config::kRequired, "roll", row.roll, config::kFinite);
  map.key(config::kRequired, "pitch", row.pitch, config::kFinite);
  map.key(config::kRequired, "yaw", row.yaw, config::kFinite);
  map.key(config::kOptional, "thrust", row.thrust, config::kNotNegative);
}

template <class Map>
void describe(Map& map, SpeedMap& speeds) {
  map.key(config::kOptional, "at_zero_rad_s", speeds.speed_at_zero, config::kNotNegative);
  map.key(config::kOptional, "per_output_rad_s", speeds.speed_per_output, config::kPositive);
}

template <class Map>
void describe_own(Map& map, config::Autopilot& autopilot, Keys& keys) {
  config::describe_period(map, autopilot);
  map.key(config::kOptional, "thrust_map", keys.thrust_map);
  map.key(config::kOptional, "affine_thrust", keys.affine_thrust);
  map.key(config::kOptional, "attitude", keys.attitude);
  map.key(config::kOptional, "rates", keys.rates);
  map.key(config::kOptional, "mixer", keys.mixer, kMixerRows);
  map.key(config::kOptional, "rotor_speeds", keys.speeds);
}

}  // namespace sls::sim::px4
