/// Random numbers with the same bits everywhere.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <cstdint>

#include "common/model/math.hpp"

namespace sls::model {

/// Finaliser of splitmix64 (Steele, Lea, Flood 2014): every bit of `x` changes half of the result.
inline std::uint64_t mix(std::uint64_t x) {
  x = (x ^ (x >> 30)) * 0xBF58476D1CE4E5B9u;
  x = (x ^ (x >> 27)) * 0x94D049BB133111EBu;
  return x ^ (x >> 31);
}

/// Random numbers by counters: each is a pure function of seed, stream (such as the place in the
/// file), step and component. It does not depend on earlier draws.
class Dice {
 public:
  Dice(std::uint64_t seed, std::uint64_t stream, std::uint64_t step)
      : key_(extend(extend(mix(seed), stream), step)) {}

  /// Uniform in (0, 1], a multiple of 2⁻⁵³.
  double calc_uniform(std::uint64_t component) const {
    constexpr double kUnit = 1.0 / 9007199254740992.0;  // 2⁻⁵³
    return (static_cast<double>(extend(key_, component) >> 11) + 1.0) * kUnit;
  }

  /// Standard normal, by Box and Muller.
  double calc_normal(std::uint64_t component) const {
    constexpr double kFullTurn = 6.283185307179586;
    const double radius = std::sqrt(-2.0 * math::log(calc_uniform(2 * component)));
    return radius * math::cos(kFullTurn * calc_uniform(2 * component + 1));
  }

  Eigen::Vector3d calc_normals(std::uint64_t component) const {
    return {calc_normal(component), calc_normal(component + 1), calc_normal(component + 2)};
  }

 private:
  static std::uint64_t extend(std::uint64_t key, std::uint64_t counter) {
    constexpr std::uint64_t kGolden = 0x9E3779B97F4A7C15u;  // odd: counters stay distinct
    return mix(key + kGolden * (counter + 1));
  }

  std::uint64_t key_;
};

}  // namespace sls::model
