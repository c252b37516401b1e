/// A plant with sensors and an estimator around it, and a delay before it. Semantics: README.md.
#pragma once

#include <memory>

#include "sim_server/plants/plant.hpp"

namespace sls::sim {

/// `plant`, which was made from `setup`, with the `sensing` and `estimator` of `scenario`; itself
/// where these change nothing.
std::unique_ptr<Plant> make_sensed(std::unique_ptr<Plant> plant, const PlantSetup& setup,
                                   const config::Scenario& scenario);

}  // namespace sls::sim
