/// A plant with sensors and an estimator at its output and a delay at its input. Semantics:
/// README.md.
#pragma once

#include <memory>

#include "sim_server/plants/plant.hpp"

namespace sls::sim {

/// Adds the `sensing` and `estimator` of `scenario` to `plant`, which was made from `setup`.
/// Returns `plant` itself if they change nothing.
std::unique_ptr<Plant> make_sensed(std::unique_ptr<Plant> plant, const PlantSetup& setup,
                                   const config::Scenario& scenario);

}  // namespace sls::sim
