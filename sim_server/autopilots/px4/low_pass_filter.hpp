/// Low-pass filter of three signals.
#pragma once

#include <Eigen/Core>
#include <cmath>

#include "common/config/scenario_keys.hpp"
#include "common/model/math.hpp"

namespace sls::sim::px4 {

/// Butterworth filter of second order: README.md, eqs. (7) and (8). It starts in the steady
/// state of the first sample.
class LowPassFilter {
 public:
  /// `cut_off` (Hz) is below half of `sample_rate` (Hz); 0 passes every sample unchanged.
  LowPassFilter(double sample_rate, double cut_off) : is_off_(cut_off == 0.0) {
    if (is_off_) return;
    // Eq. (7).
    const double w = math::tan(config::kPi * cut_off / sample_rate);
    const double scale = 1.0 / (1.0 + std::sqrt(2.0) * w + w * w);
    gain_ = w * w * scale;
    a1_ = 2.0 * (w * w - 1.0) * scale;
    a2_ = (1.0 - std::sqrt(2.0) * w + w * w) * scale;
  }

  Eigen::Vector3d step(const Eigen::Vector3d& sample) {
    if (is_off_) return sample;
    if (!has_started_) {
      last_ = last_but_one_ = sample / (1.0 + a1_ + a2_);
      has_started_ = true;
    }
    // Eq. (8).
    const Eigen::Vector3d now = sample - a1_ * last_ - a2_ * last_but_one_;
    const Eigen::Vector3d filtered = gain_ * (now + 2.0 * last_ + last_but_one_);
    last_but_one_ = last_;
    last_ = now;
    return filtered;
  }

 private:
  double gain_ = 1.0, a1_ = 0.0, a2_ = 0.0;
  bool is_off_, has_started_ = false;
  Eigen::Vector3d last_, last_but_one_;  // values of the delay line
};

}  // namespace sls::sim::px4
