/// What the thrust of a vehicle lacks: scale, drift, battery and failures. Equations:
/// sim_server/plants/README.md, "Thrust".
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "common/config/scenario.hpp"
#include "common/model/measurement.hpp"
#include "sim_server/plants/plant.hpp"

namespace sls::sim {

/// How many signals the thrust of each vehicle has: 0 if all give what is wanted.
inline std::size_t count_thrust_signals(const config::Scenario& scenario) {
  const config::Thrust& thrust = scenario.plant.thrust;
  bool acts = thrust.scale != 1.0 || thrust.drift != 0.0 || !thrust.failures.empty();
  for (const config::VehicleVariant& own : scenario.vehicles) acts |= own.thrust_scale.has_value();
  return thrust.battery ? 3 : acts ? 1 : 0;
}

class ThrustSource {
 public:
  /// That of `setup.vehicles[vehicle]`.
  ThrustSource(const PlantSetup& setup, std::size_t vehicle);

  /// True thrust per believed thrust of the whole vehicle, from `step` on; without failures of
  /// single rotors.
  double calc_scale(std::int64_t step) const;
  /// Of a rotor (from 0) alone, by failures.
  double calc_rotor_scale(std::int64_t step, std::size_t rotor) const;
  /// The vehicle gives `thrust` (N) over a step.
  void discharge(double thrust);

  double charge() const { return charge_; }
  void set_charge(double charge) { charge_ = charge; }

  void list_signals(std::vector<Signal>& signals) const;
  void add_signals(std::int64_t step, model::Numbers& signals) const;

 private:
  double calc_voltage() const;

  const config::Thrust thrust_;
  const double scale_;
  const std::int64_t vehicle_, step_ns_;
  const double hover_thrust_;  // N
  double charge_ = 1.0;        // 1: full
  double power_ = 0.0;         // in the last step, W
};

/// The plant, and if it moves point masses whose thrust lacks something, with forces that lack it.
std::unique_ptr<Plant> make_tired(std::unique_ptr<Plant> plant, const PlantSetup& setup);

}  // namespace sls::sim
