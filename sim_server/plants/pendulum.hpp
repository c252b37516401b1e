/// Model of the pendulum: a key of several plants.
#pragma once

#include <array>
#include <cmath>

#include "common/config/numbers.hpp"
#include "common/config/scenario_keys.hpp"
#include "common/config/scenario_reader.hpp"

namespace sls::sim {

enum class Pendulum {
  kIdeal,  ///< point load on a massless rod
  kRigid,  ///< rod and load with inertia
};
inline std::array<config::Name<Pendulum>, 2> names_of(Pendulum) {
  return {{{"ideal", Pendulum::kIdeal}, {"rigid", Pendulum::kRigid}}};
}

/// For plants whose coordinates are the rod angles. @throws config::ConfigError if β is ±π/2.
inline void check_rod_angles(const config::Plant& plant, const config::Places& places) {
  const double beta = plant.initial.rod.beta;
  if (config::kPi / 2 - std::abs(beta) > 1e-9) return;
  throw places.make_error_at(
      "plant.initial.beta_rad",
      "expected between -pi/2 and pi/2 (alpha has no rate at them), got " + config::to_text(beta));
}

}  // namespace sls::sim
