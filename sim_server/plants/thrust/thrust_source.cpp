#include "sim_server/plants/thrust/thrust_source.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace sls::sim {

ThrustSource::ThrustSource(const PlantSetup& setup, std::size_t vehicle)
    : thrust_(setup.plant.thrust),
      scale_(setup.vehicles[vehicle].thrust_scale),
      vehicle_(setup.vehicles[vehicle].id),
      step_ns_(setup.plant.step_ns),
      hover_thrust_(setup.vehicles[vehicle].parameters.total_mass() *
                    setup.vehicles[vehicle].parameters.gravity) {
  if (thrust_.battery) power_ = thrust_.battery->hover_power_w;
}

/// Eq. (11): what is left of the open-circuit voltage under the power of the last step.
double ThrustSource::calc_voltage() const {
  const config::Battery& battery = *thrust_.battery;
  const double open = battery.empty_v + (battery.full_v - battery.empty_v) * charge_;
  const double left = open * open - 4.0 * battery.resistance_ohm * power_;
  return 0.5 * (open + std::sqrt(std::max(0.0, left)));
}

double ThrustSource::calc_scale(std::int64_t step) const {
  const double time = 1e-9 * static_cast<double>(step * step_ns_);
  double scale = scale_ * std::max(0.0, 1.0 + thrust_.drift * time);
  if (thrust_.battery) {
    const double voltage = calc_voltage() / thrust_.battery->full_v;
    scale *= voltage * voltage;
  }
  for (const config::ThrustFailure& failure : thrust_.failures)
    if (!failure.rotor && failure.vehicle == vehicle_ && step * step_ns_ >= failure.at_ns)
      scale *= failure.scale;
  return scale;
}

double ThrustSource::calc_rotor_scale(std::int64_t step, std::size_t rotor) const {
  double scale = 1.0;
  for (const config::ThrustFailure& failure : thrust_.failures)
    if (failure.rotor == static_cast<int>(rotor) + 1 && failure.vehicle == vehicle_ &&
        step * step_ns_ >= failure.at_ns)
      scale *= failure.scale;
  return scale;
}

void ThrustSource::discharge(double thrust) {
  if (!thrust_.battery) return;
  const config::Battery& battery = *thrust_.battery;
  const double share = thrust / hover_thrust_;
  power_ = battery.hover_power_w * share * std::sqrt(share);
  constexpr double kHour = 3600.0;  // s
  const double current = power_ / calc_voltage();
  charge_ -= current * 1e-9 * static_cast<double>(step_ns_) / (kHour * battery.capacity_ah);
  charge_ = std::max(0.0, charge_);
}

void ThrustSource::list_signals(std::vector<Signal>& signals) const {
  signals.push_back({"thrust_scale", "1"});
  if (!thrust_.battery) return;
  signals.push_back({"battery_v", "V"});
  signals.push_back({"battery_charge", "1"});
}

void ThrustSource::add_signals(std::int64_t step, model::Numbers& signals) const {
  Eigen::Index at = signals.size();
  signals.conservativeResize(at + (thrust_.battery ? 3 : 1));
  signals[at++] = calc_scale(step);
  if (!thrust_.battery) return;
  signals[at++] = calc_voltage();
  signals[at] = charge_;
}

namespace {

/// Point masses: each force acts with the scale of its vehicle.
class TiredPlant : public Plant {
 public:
  TiredPlant(std::unique_ptr<Plant> plant, const PlantSetup& setup) : plant_(std::move(plant)) {
    for (std::size_t i = 0; i < setup.vehicles.size(); ++i) sources_.emplace_back(setup, i);
    measurements_.resize(sources_.size());
    measure();
  }

  void advance(const std::vector<Eigen::Vector3d>& f_Q_W, std::int64_t steps) override {
    acting_.resize(f_Q_W.size());
    for (std::int64_t k = 0; k < steps; ++k) {
      for (std::size_t i = 0; i < sources_.size(); ++i)
        acting_[i] = sources_[i].calc_scale(step_) * f_Q_W[i];
      plant_->advance(acting_, 1);
      ++step_;
      for (std::size_t i = 0; i < sources_.size(); ++i)
        sources_[i].discharge(std::sqrt(acting_[i].squaredNorm()));
    }
    if (steps <= 0) plant_->advance(f_Q_W, steps);  // refuses forces that are not finite
    measure();
  }
  const model::Measurement& measurement(std::size_t vehicle) const override {
    return measurements_[vehicle];
  }
  std::vector<Signal> signals() const override {
    std::vector<Signal> signals = plant_->signals();
    sources_[0].list_signals(signals);
    return signals;
  }
  std::vector<std::string> take_remarks(std::size_t vehicle) override {
    return plant_->take_remarks(vehicle);
  }

 private:
  void measure() {
    for (std::size_t i = 0; i < sources_.size(); ++i) {
      measurements_[i] = plant_->measurement(i);
      sources_[i].add_signals(step_, measurements_[i].signals);
    }
  }

  const std::unique_ptr<Plant> plant_;
  std::vector<ThrustSource> sources_;
  std::int64_t step_ = 0;
  std::vector<Eigen::Vector3d> acting_;
  std::vector<model::Measurement> measurements_;
};

}  // namespace

std::unique_ptr<Plant> make_tired(std::unique_ptr<Plant> plant, const PlantSetup& setup) {
  if (plant->has_attitude() || !setup.lacks_thrust) return plant;
  return std::make_unique<TiredPlant>(std::move(plant), setup);
}

}  // namespace sls::sim
