/// The rotors of one vehicle and the autopilot that sets their speeds, for every plant that flies a
/// rigid body. README.md, eqs. (1) to (5). No Simbody here.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "sim_server/autopilots/autopilot.hpp"
#include "sim_server/plants/multirotor/airframe.hpp"
#include "sim_server/plants/multirotor/rotor_model.hpp"
#include "sim_server/plants/multirotor/saturation_watch.hpp"
#include "sim_server/plants/plant.hpp"
#include "sim_server/plants/thrust/thrust_source.hpp"

namespace sls::sim {

class RotorDrive {
 public:
  /// The values that a step changes, besides the autopilot's memory and the remarks.
  struct State {
    AutopilotOutput output;      ///< the last one; its direction is in the plant's W
    Eigen::VectorXd set_points;  ///< of the rotors, within their limits, rad/s
    Eigen::VectorXd speeds;      ///< rad/s
    double charge = 1.0;         ///< of the battery
  };

  /// The rotors of `setup.vehicles[vehicle]`.
  /// @throws config::ConfigError if the autopilot refuses the setup.
  RotorDrive(const AirframeKeys& keys, const PlantSetup& setup, std::size_t vehicle);

  const Airframe& airframe() const { return airframe_; }
  std::size_t size() const { return rotors_.size(); }
  const State& state() const { return state_; }
  void set_state(const State& state);
  void set_speed(std::size_t rotor, double speed) {
    state_.speeds[static_cast<Eigen::Index>(rotor)] = speed;
  }

  /// The rotors turn at the same thrusts, together `thrust` (N).
  void start(double thrust);

  /// At the beginning of the plant's `step`: the autopilot, if its period begins.
  /// @throws std::runtime_error if a number of the autopilot is not finite.
  void step(const Eigen::Vector3d& f_Q_W, const Eigen::Vector3d& v_WQ,
            const model::Attitude& attitude, std::int64_t step);

  /// Speeds of a rotor that begins with `speed`, over a plant step or over `h` seconds.
  RotorLag::Stages find_stages(std::size_t rotor, double speed) const {
    return lags_[rotor].find_stages(speed, state_.set_points[static_cast<Eigen::Index>(rotor)]);
  }
  RotorLag::Stages find_stages(std::size_t rotor, double speed, double h) const;

  /// Loads on the body, eqs. (3) to (5), of rotors that turn as the `size()` speeds from `turning`
  /// on. `v_B` is the velocity of the body's origin through the air, `w_B` its rates, both in B.
  /// `direction_B` is the output's direction in B, if it has one.
  RotorLoads calc_loads(const RotorSpeed* turning, const Eigen::Vector3d& v_B,
                        const Eigen::Vector3d& w_B,
                        const std::optional<Eigen::Vector3d>& direction_B) const;

  /// Speeds, set-points, attitude set-point, thrust: of the set-point, and `thrust` (N).
  std::vector<Signal> list_signals() const;
  model::Numbers calc_signals(double thrust, std::int64_t step) const;

  std::vector<std::string> take_remarks() { return watch_.take_remarks(); }

 private:
  void limit(Eigen::VectorXd& wanted) const;
  void scale_thrusts(std::int64_t step);

  const Airframe airframe_;
  std::vector<FlyingRotor> rotors_;  // with the scales of their thrusts in the step
  std::vector<double> own_scales_;   // of the rotors, constant
  std::optional<ThrustSource> source_;
  const double step_s_;
  const Eigen::Quaterniond attitude_error_;  // estimated attitude = this × true one
  std::vector<RotorLag> lags_;               // of the rotors, over a plant step
  std::int64_t autopilot_steps_;             // plant steps per period
  std::unique_ptr<Autopilot> autopilot_;
  SaturationWatch watch_;
  State state_;
};

}  // namespace sls::sim
