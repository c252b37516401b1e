/// The plant: a quadrotor as a point mass with a load on a spherical joint, integrated by Simbody.
/// No DDS here. Equations and choices: README.md.
#pragma once

#include <Eigen/Core>
#include <memory>

#include "sim_server/plants/plant.hpp"

namespace sls::sim {

/// Its masses and length are those of the vehicle for `ideal`, and those of the published links for
/// `rigid`.
class SlungLoadPlant : public Plant {
 public:
  /// Builds the multibody system at its initial state.
  /// @throws config::ConfigError if `vehicle` contradicts the links of the rigid pendulum.
  SlungLoadPlant(const model::SlungLoadParameters& vehicle, const config::Plant& plant);
  ~SlungLoadPlant() override;
  SlungLoadPlant(const SlungLoadPlant&) = delete;
  SlungLoadPlant& operator=(const SlungLoadPlant&) = delete;

  /// Integrates one fixed step of `plant.step_ns` with the control force `f_Q_W` (N) held.
  /// Deterministic: the same calls give the same bits.
  /// @throws std::runtime_error naming the quantity if the state is not finite afterwards.
  void step(const Eigen::Vector3d& f_Q_W);

  /// State after the last step.
  const model::SlungLoadState& state() const;

  void advance(const std::vector<Eigen::Vector3d>& f_Q_W, std::int64_t steps) override;
  const model::Measurement& measurement(std::size_t) const override;
  std::vector<Signal> signals() const override;

 private:
  struct Multibody;
  std::unique_ptr<Multibody> multibody_;
};

}  // namespace sls::sim
