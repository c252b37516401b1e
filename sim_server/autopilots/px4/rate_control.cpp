#include "sim_server/autopilots/px4/rate_control.hpp"

#include <algorithm>

namespace sls::sim::px4 {

using Eigen::Vector3d;

RateControl::RateControl(const RateGains& gains, double period_s)
    : gains_(gains),
      period_s_(period_s),
      rate_filter_(1.0 / period_s, gains.rate_cut_off),
      derivative_filter_(1.0 / period_s, gains.derivative_cut_off) {}

Vector3d RateControl::step(const Vector3d& rates, const Vector3d& rate_set_points,
                           const Saturation& saturation) {
  const Vector3d filtered = rate_filter_.step(rates);
  if (!has_started_) last_rates_ = filtered;
  has_started_ = true;
  // Eq. (9).
  const Vector3d acceleration = derivative_filter_.step((filtered - last_rates_) / period_s_);
  last_rates_ = filtered;
  // Eq. (10), with the integral up to the previous step.
  const Vector3d error = rate_set_points - filtered;
  const Vector3d torque = gains_.proportional.cwiseProduct(error) + integral_ -
                          gains_.derivative.cwiseProduct(acceleration);
  integrate(error, saturation);
  return torque;
}

void RateControl::integrate(const Vector3d& error, const Saturation& saturation) {
  for (int axis = 0; axis < 3; ++axis) {
    const auto i = static_cast<std::size_t>(axis);
    double e = error[axis];
    if (saturation.positive[i]) e = std::min(e, 0.0);
    if (saturation.negative[i]) e = std::max(e, 0.0);
    // Eq. (11). Without the factor a flip would fill the integrator and then overshoot.
    const double part = e / gains_.integral_off_error;
    const double factor = std::max(0.0, 1.0 - part * part);
    const double next = integral_[axis] + factor * gains_.integral[axis] * e * period_s_;
    const double limit = gains_.integral_limits[axis];
    integral_[axis] = std::max(-limit, std::min(limit, next));
  }
}

}  // namespace sls::sim::px4
