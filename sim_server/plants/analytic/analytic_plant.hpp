/// The ideal slung load in closed form, without Simbody: for campaigns. README.md, eqs. (1) and
/// (2).
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "sim_server/plants/air/air.hpp"
#include "sim_server/plants/plant.hpp"

namespace sls::sim {

/// One vehicle: centre of mass, rod direction and its angular velocity, integrated by a fixed-step
/// Runge-Kutta method of fourth order.
class AnalyticPlant : public Plant {
 public:
  AnalyticPlant(const model::SlungLoadParameters& vehicle, const config::Plant& plant);

  void advance(const std::vector<Eigen::Vector3d>& f_Q_W, std::int64_t steps) override;
  const model::Measurement& measurement(std::size_t) const override { return measurement_; }
  std::vector<Signal> signals() const override;

 private:
  /// The motion, or its rate of change.
  struct Motion {
    Eigen::Vector3d p_WC;  ///< centre of mass of both bodies, m
    Eigen::Vector3d v_WC;  ///< m/s
    Eigen::Vector3d n_W;   ///< rod direction Q→L, unit vector
    Eigen::Vector3d w_W;   ///< angular velocity of the rod, normal to it, rad/s
  };

  static Motion add(const Motion& motion, double h, const Motion& rate);
  Motion calc_rate(const Motion& motion, const Eigen::Vector3d& f_Q_W) const;
  Motion calc_next(const Motion& start, const Eigen::Vector3d& f_Q_W) const;
  void hold_wind(std::int64_t step, const Motion& motion);
  model::SlungLoadState to_state(const Motion& motion) const;
  model::Measurement measure(std::int64_t step, const Motion& motion) const;

  const model::SlungLoadParameters vehicle_;
  model::Aerodynamics quad_air_;  // with the wind held over a step
  const Air air_;
  Eigen::Vector3d load_wind_W_;  // held over a step, m/s
  const Eigen::Vector3d disturbance_W_;
  const double step_s_;
  const double total_mass_;       // m + m_L, kg
  const double arm_;              // from the quadrotor to the centre of mass, m
  const double inverse_inertia_;  // 1 / (m L), 1/(kg·m)
  std::int64_t steps_ = 0;
  Motion motion_;
  model::Measurement measurement_;
};

}  // namespace sls::sim
