/// The group that a scenario describes, at its start.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "sim_server/plants/cables/keys.hpp"
#include "sim_server/plants/cables/mechanics.hpp"
#include "sim_server/plants/plant.hpp"

namespace sls::sim::cables {

struct Start {
  System system;
  Motion motion;
};

/// The load's centre of mass as vehicle `index` places it: by the position of its own cable's end
/// or of itself, its cable and its attachment. All vehicles must agree.
Eigen::Vector3d calc_load_centre(const CablesKeys& keys, const PlantSetup::Vehicle& vehicle,
                                 std::size_t index);

/// The keys' cables are none or one for each of the `vehicles`, which agree. The load's mass is the
/// sum of the vehicles' shares; its velocity follows from that of the first vehicle and its rod.
Start make_start(const CablesKeys& keys, const std::vector<PlantSetup::Vehicle>& vehicles);

}  // namespace sls::sim::cables
