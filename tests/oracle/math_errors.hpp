// Errors of common/model/math.hpp against MPFR.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace sls::test {

struct GreatestError {
  std::string function;
  double ulps = 0.0;        ///< units in the last place of the exact result; subnormal: of 2^-1074
  double x = 0.0, y = 0.0;  ///< where it is; y of atan2 alone
};

/// The greatest error of each function over `count` arguments drawn with `seed`: everyday ones, any
/// bit pattern of a finite number, and those near the places where an algorithm is weakest
/// (multiples of π/2, 1, bounds of tables).
std::vector<GreatestError> find_greatest_errors(std::int64_t count, std::uint64_t seed);

}  // namespace sls::test
