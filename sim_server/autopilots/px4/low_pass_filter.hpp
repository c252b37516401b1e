/// Low-pass filter of three signals.
#pragma once

#include <Eigen/Core>

namespace sls::sim::px4 {

/// Butterworth filter of second order: README.md, eqs. (7) and (8). It starts in the steady
/// state of the first sample.
class LowPassFilter {
 public:
  /// `cut_off` (Hz) is below half of `sample_rate` (Hz); 0 passes every sample unchanged.
  LowPassFilter(double sample_rate, double cut_off);

  Eigen::Vector3d step(const Eigen::Vector3d& sample);

 private:
  double gain_ = 1.0, a1_ = 0.0, a2_ = 0.0;
  bool is_off_, has_started_ = false;
  Eigen::Vector3d last_, last_but_one_;  // values of the delay line
};

}  // namespace sls::sim::px4
