/// Orientation of a rod for plants that use Simbody, by our own sine and cosine; Simbody would call
/// those of the C library.
#pragma once

#include <Simbody.h>

#include "common/model/math.hpp"
#include "common/model/state.hpp"

namespace sls::sim {

/// Rotation whose z axis is the rod: by α about x, then by β about the new y. Source:
/// common/model/README.md, eq. (1).
inline SimTK::Rotation make_rod_frame(const model::RodAngles& rod) {
  const auto [sin_a, cos_a] = math::sincos(rod.alpha);
  const auto [sin_b, cos_b] = math::sincos(rod.beta);
  constexpr bool kIsRotation = true;  // Simbody need not check it
  return {SimTK::Mat33(cos_b, 0.0, sin_b, sin_a * sin_b, cos_a, -sin_a * cos_b, -cos_a * sin_b,
                       sin_a, cos_a * cos_b),
          kIsRotation};
}

}  // namespace sls::sim
