#pragma once

#include <Eigen/Core>
#include <random>

namespace sls::test {

/// A vector with independent normal components of mean 0 and standard deviation `scale`.
inline Eigen::Vector3d draw_vector(std::mt19937& generator, double scale) {
  std::normal_distribution<double> normal(0.0, scale);
  const double x = normal(generator), y = normal(generator), z = normal(generator);
  return {x, y, z};
}

}  // namespace sls::test
