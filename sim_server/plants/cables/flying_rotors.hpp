/// The rotors and autopilots of a group of vehicles: those of `multirotor`. README.md, "Rotors".
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "sim_server/plants/cables/hybrid_motion.hpp"
#include "sim_server/plants/multirotor/rotor_drive.hpp"

namespace sls::sim::cables {

class FlyingRotors : public Propulsion {
 public:
  /// The rotors give what carries each vehicle, and with a taut cable its share of the load; those
  /// of vehicles that stand give nothing. `motion` gets their speeds.
  /// @throws config::ConfigError if an autopilot refuses the setup.
  FlyingRotors(const AirframeKeys& keys, const PlantSetup& setup, HybridMotion& motion);

  void set_wind(const Vectors& v_wind_W) { v_wind_W_ = v_wind_W; }
  /// At the beginning of the plant's `step`: autopilots, whose set-points are then held.
  void begin_step(const Vectors& f_Q_W, std::int64_t step, HybridMotion& motion);
  void end_step(const HybridMotion& motion);

  void turn(const RotorSpeeds& start, double h, RotorSpeeds& middle, RotorSpeeds& end,
            RotorSpeeds& after) const override;
  void push(const Motion& motion, const RotorSpeeds& speeds, Actions& actions) const override;

  const RotorDrive& of(std::size_t vehicle) const { return drives_[vehicle]; }
  std::vector<std::string> take_remarks(std::size_t vehicle) {
    return drives_[vehicle].take_remarks();
  }
  model::Numbers calc_signals(std::size_t vehicle, const HybridMotion& motion,
                              std::int64_t step) const;

 private:
  RotorLoads calc_loads(std::size_t vehicle, const Motion& motion, const RotorSpeeds& speeds,
                        const Eigen::Matrix3d& R_WB) const;

  std::vector<RotorDrive> drives_;  // with the same number of rotors
  Vectors v_wind_W_;                // at each vehicle, held over a step, m/s
  const Eigen::Vector3d torque_W_;  // disturbance on each vehicle, N·m
};

/// The attitude of a vehicle.
model::Attitude to_attitude(const Turn& turn);

}  // namespace sls::sim::cables
