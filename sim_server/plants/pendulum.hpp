/// Model of the pendulum: a key of several plants.
#pragma once

#include <array>

#include "common/config/scenario_keys.hpp"

namespace sls::sim {

enum class Pendulum {
  kIdeal,  ///< point load on a massless rod
  kRigid,  ///< rod and load with inertia
};
inline std::array<config::Name<Pendulum>, 2> names_of(Pendulum) {
  return {{{"ideal", Pendulum::kIdeal}, {"rigid", Pendulum::kRigid}}};
}

}  // namespace sls::sim
