/// The air of every plant of the project: wind by place and time, and the drag of the load.
/// Equations: sim_server/plants/README.md, "Air".
#pragma once

#include <Eigen/Core>
#include <optional>

#include "common/config/scenario.hpp"
#include "common/model/forces.hpp"
#include "common/model/measurement.hpp"
#include "sim_server/plants/air/turbulence.hpp"
#include "sim_server/plants/plant.hpp"

namespace sls::sim {

class Air {
 public:
  explicit Air(const config::Plant& plant);

  bool varies() const { return wind_.varies(); }
  bool drags_load() const { return drag_.acts(); }

  /// The wind at a time (s) and place (m, in W): m/s, in W.
  /// @throws std::runtime_error beyond the reach of the turbulence.
  Eigen::Vector3d calc_wind(double time, const Eigen::Vector3d& p_W) const;

  /// The wind at the middle of a step of `h` seconds, which plants hold over the step.
  Eigen::Vector3d calc_held_wind(double start, double h, const Eigen::Vector3d& p_W,
                                 const Eigen::Vector3d& v_W) const {
    if (!varies()) return mean_W_;
    return calc_wind(start + 0.5 * h, p_W + 0.5 * h * v_W);
  }

  /// Force on a load that moves with `v_WL` (m/s) in the wind: N.
  Eigen::Vector3d calc_load_drag(const Eigen::Vector3d& v_WL,
                                 const Eigen::Vector3d& v_wind_W) const {
    return model::calc_load_drag(v_WL, v_wind_W, drag_);
  }

  /// The wind at the vehicle, if it varies, and the drag of the load, if it has one: added to a
  /// list, and to the signals of a measurement.
  void list_signals(std::vector<Signal>& signals) const;
  void add_signals(double time, const Eigen::Vector3d& p_WQ, const Eigen::Vector3d& p_WL,
                   const Eigen::Vector3d& v_WL, model::Numbers& signals) const;
  void add_signals(double time, model::Measurement& measured) const {
    add_signals(time, measured.p_WQ, measured.p_WL, measured.v_WL, measured.signals);
  }
  /// How many they are.
  static std::size_t count_signals(const config::Plant& plant) {
    return (plant.wind.varies() ? 3u : 0u) + (plant.load_drag.acts() ? 3u : 0u);
  }

 private:
  const Eigen::Vector3d mean_W_;
  const config::Wind wind_;
  const model::LoadDrag drag_;
  mutable std::optional<Turbulence> turbulence_;  // computes its field where it is asked for
};

}  // namespace sls::sim
