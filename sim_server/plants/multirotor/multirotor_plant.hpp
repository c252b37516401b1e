/// The plant: a rigid body with rotors and an autopilot, and a load on a spherical joint,
/// integrated by Simbody. No DDS here. Equations and choices: README.md.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <string>
#include <vector>

#include "sim_server/plants/plant.hpp"

namespace sls::sim {

class MultirotorPlant : public Plant {
 public:
  /// One vehicle, `setup.vehicles[0]`, at its initial state with its rotors at hover speed.
  /// @throws config::ConfigError if the autopilot refuses the setup.
  explicit MultirotorPlant(const PlantSetup& setup);
  ~MultirotorPlant() override;
  MultirotorPlant(const MultirotorPlant&) = delete;
  MultirotorPlant& operator=(const MultirotorPlant&) = delete;

  void advance(const std::vector<Eigen::Vector3d>& f_Q_W, std::int64_t steps) override;
  const model::Measurement& measurement(std::size_t) const override;
  bool has_attitude() const override { return true; }
  std::vector<Signal> signals() const override;
  std::vector<std::string> take_remarks(std::size_t) override;

 private:
  struct Multibody;
  std::unique_ptr<Multibody> multibody_;
};

}  // namespace sls::sim
