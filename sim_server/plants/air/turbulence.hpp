/// Dryden turbulence as a frozen field that the mean wind carries. A pure function of its
/// parameters and the place in the air. Equations: sim_server/plants/README.md, "Air".
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <deque>

#include "common/config/scenario.hpp"

namespace sls::sim {

/// Scale lengths (m) and standard deviations (m/s) along the wind, across it and downwards.
struct DrydenParameters {
  Eigen::Vector3d length, deviation;
};
/// Those of MIL-F-8785C for altitudes of at most 1000 ft.
DrydenParameters calc_dryden_parameters(const config::Turbulence& turbulence);

class Turbulence {
 public:
  /// `v_wind_W`: the mean wind, m/s, not vertical.
  Turbulence(const config::Turbulence& turbulence, const Eigen::Vector3d& v_wind_W);

  /// Velocity that it adds at a time (s) and place (m, in W): m/s, in W.
  /// @throws std::runtime_error at a place that is further than its reach from the origin, along
  ///   the wind.
  Eigen::Vector3d at(double time, const Eigen::Vector3d& p_W);

  /// In the axes of the wind, `way` metres into the air that was at the origin at time 0. The ways
  /// of all calls grow, but for twice the reach.
  Eigen::Vector3d at(double way);

 private:
  /// An output of the filters: one of first order, two of second order.
  struct Filters {
    double along = 0.0;
    Eigen::Vector2d first, second;  // across, downwards
  };
  Eigen::Vector3d extend();

  const std::uint64_t seed_;
  const double speed_;  // of the mean wind over the ground, m/s
  const Eigen::Vector3d along_W_;
  const DrydenParameters parameters_;
  const double spacing_;
  Eigen::Vector3d kept_;                    // e^(−spacing / length)
  Eigen::Vector2d first_, mixed_, second_;  // factor of the noise of both filters
  Filters filters_;
  std::int64_t next_;  // place to compute, in spacings
  std::deque<Eigen::Vector3d> computed_;
};

}  // namespace sls::sim
