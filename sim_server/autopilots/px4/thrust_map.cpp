#include "sim_server/autopilots/px4/thrust_map.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace sls::sim::px4 {
namespace {

double limit(double thrust) { return std::max(0.0, std::min(1.0, thrust)); }

}  // namespace

double calc_affine_thrust(const AffineThrust& map, double force) {
  return limit((force - map.force) / map.force_per_thrust + map.thrust);
}

ExactThrust::ExactThrust(const std::vector<Rotor>& rotors, const std::vector<MixerRow>& mixer,
                         const SpeedMap& speeds) {
  for (std::size_t i = 0; i < rotors.size(); ++i) {
    const double lift = -rotors[i].axis_B.z() * rotors[i].thrust_constant;
    const double slope = speeds.speed_per_output * mixer[i].thrust;
    square_ += lift * slope * slope;
    linear_ += 2.0 * lift * slope * speeds.speed_at_zero;
    constant_ += lift * speeds.speed_at_zero * speeds.speed_at_zero;
  }
  if (!(square_ > 0.0 && linear_ >= 0.0))
    throw std::invalid_argument("expected rotors that lift more as the thrust grows");
}

double ExactThrust::calc_thrust(double force) const {
  const double missing = force - constant_;
  if (!(missing > 0.0)) return 0.0;
  // This form of the root avoids the difference of nearly equal numbers.
  return limit(2.0 * missing / (linear_ + std::sqrt(linear_ * linear_ + 4.0 * square_ * missing)));
}

}  // namespace sls::sim::px4
