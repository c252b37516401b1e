/// From the error of the body rates to normalised torques.
#pragma once

#include <Eigen/Core>
#include <array>

#include "sim_server/autopilots/px4/low_pass_filter.hpp"

namespace sls::sim::px4 {

/// Axes (roll, pitch, yaw) on which a larger or smaller torque would only saturate rotors further.
struct Saturation {
  std::array<bool, 3> positive{};
  std::array<bool, 3> negative{};
};

/// Gains per axis. Torques are normalised: ±1 is the range of the mixer's input.
struct RateGains {
  Eigen::Vector3d proportional{0.15, 0.15, 0.2};   ///< per rad/s
  Eigen::Vector3d integral{0.2, 0.2, 0.1};         ///< per rad
  Eigen::Vector3d derivative{0.003, 0.003, 0.0};   ///< per rad/s²
  Eigen::Vector3d integral_limits{0.3, 0.3, 0.3};  ///< largest torque of the integrator
  double integral_off_error = 6.9813170079773181;  ///< 400 °/s: no integration beyond, rad/s
  double rate_cut_off = 40.0;                      ///< Hz; 0: no filter
  double derivative_cut_off = 30.0;                ///< Hz; 0: no filter
};

/// PID with filters: README.md, eqs. (7) to (11).
class RateControl {
 public:
  RateControl(const RateGains& gains, double period_s);

  /// Normalised torques about the axes of B. `rates` is the angular velocity in B (rad/s);
  /// `saturation` is that of the mixer at the previous torques.
  Eigen::Vector3d step(const Eigen::Vector3d& rates, const Eigen::Vector3d& rate_set_points,
                       const Saturation& saturation);

 private:
  void integrate(const Eigen::Vector3d& error, const Saturation& saturation);

  const RateGains gains_;
  const double period_s_;
  LowPassFilter rate_filter_;
  LowPassFilter derivative_filter_;
  bool has_started_ = false;
  Eigen::Vector3d last_rates_ = Eigen::Vector3d::Zero();  // filtered
  Eigen::Vector3d integral_ = Eigen::Vector3d::Zero();
};

}  // namespace sls::sim::px4
