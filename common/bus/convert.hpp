/// Between wire types and the model's types.
#pragma once

#include <Eigen/Core>
#include <array>

#include "common/bus/topics.hpp"

namespace sls::bus {

inline std::array<double, 3> to_array(const Eigen::Vector3d& vector) {
  return {vector.x(), vector.y(), vector.z()};
}

inline Eigen::Vector3d to_vector(const std::array<double, 3>& array) {
  return {array[0], array[1], array[2]};
}

}  // namespace sls::bus
