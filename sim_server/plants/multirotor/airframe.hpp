/// The rigid body that a scenario describes: its mass properties, its rotors and checks of
/// both. No Simbody here.
#pragma once

#include <vector>

#include "sim_server/autopilots/autopilot.hpp"
#include "sim_server/plants/multirotor/airframe_keys.hpp"

namespace sls::sim {

/// A rotor with the parameters that the autopilot does not have.
struct FlyingRotor : Rotor {
  double drag_constant = 0.0;      ///< N·s²/m
  double rolling_constant = 0.0;   ///< N·s²
  double lag_up = 0.0;             ///< s
  double lag_down = 0.0;           ///< s
  double thrust_loss_speed = 0.0;  ///< m/s; 0: no loss
  double thrust_scale = 1.0;       ///< true thrust per that of thrust_constant
};

/// The rotors that the keys describe, their axes of length 1.
std::vector<FlyingRotor> make_rotors(const AirframeKeys& keys);

/// The body with everything fixed to it. `quad_mass` is the mass of the whole.
Airframe make_airframe(const AirframeKeys& keys, double quad_mass);

/// Largest collective thrust of a level vehicle at rest, N.
double calc_largest_lift(const std::vector<FlyingRotor>& rotors);

}  // namespace sls::sim
