/// The scenario's faults of one vehicle, in simulation time. A pure function of scenario and steps:
/// the same seed gives the same bytes at any speed of the host. Semantics: README.md. No network
/// here.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <vector>

#include "common/config/scenario.hpp"
#include "common/model/measurement.hpp"

namespace sls::sim {

class FaultLine {
 public:
  /// Keeps the faults of `scenario` that concern `vehicle_id`.
  FaultLine(const config::Scenario& scenario, std::uint32_t vehicle_id);
  ~FaultLine();
  FaultLine(FaultLine&&) noexcept;

  /// True if the measurement can differ from the truth.
  bool can_disturb_state() const;

  /// The controllers' measurement at `step`. Call once per step, in order, from step 0.
  model::Measurement measure(std::uint64_t step, const model::Measurement& truth);

  /// The force (N, in W) that acts on the quadrotor over [step, step + 1) if `f_Q_W` is commanded.
  /// Call once per step, in order, from step 0.
  Eigen::Vector3d actuate(std::uint64_t step, const Eigen::Vector3d& f_Q_W);

 private:
  struct Channels;
  std::unique_ptr<Channels> channels_;
};

}  // namespace sls::sim
