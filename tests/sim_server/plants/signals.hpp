/// The signals of a plant by their names.
#pragma once

#include <stdexcept>
#include <string>

#include "sim_server/plants/plant.hpp"

namespace sls::sim {

/// The value of a signal in the measurement of a vehicle.
inline double find(const Plant& plant, std::size_t vehicle, const std::string& name) {
  const std::vector<Signal> signals = plant.signals();
  for (std::size_t i = 0; i < signals.size(); ++i)
    if (signals[i].name == name)
      return plant.measurement(vehicle).signals[static_cast<Eigen::Index>(i)];
  throw std::out_of_range(name);
}

}  // namespace sls::sim
