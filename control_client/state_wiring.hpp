/// How the state sample's rod angles reach the controller. Source: README.md, eq. (14).
#pragma once

#include "common/config/scenario.hpp"
#include "common/model/state.hpp"

namespace sls::control {

/// The values that the law's slots (α, β, α̇, β̇) receive for the true rod angles. `gazebo_plugin`
/// reproduces the published plugin. `rod_length` is that of the plant, m.
model::RodAngles calc_wired_angles(const model::RodAngles& rod, config::StateWiring wiring,
                                   double rod_length);

}  // namespace sls::control
