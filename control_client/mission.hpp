/// The mission: the stage in force at a step and its reference. Source: README.md, "References and
/// mission".
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/config/scenario.hpp"
#include "common/model/answer.hpp"
#include "common/model/measurement.hpp"
#include "common/model/reference.hpp"
#include "control_client/reference_trajectory.hpp"

namespace sls::control {

/// Progress of the mission at one step.
struct MissionProgress {
  std::uint32_t stage = 0;             ///< in force; after the end of the mission the last one
  std::uint32_t remembered_stage = 0;  ///< `stage`, or the number of stages once all are over
  std::uint64_t stage_start_step = 0;
  model::MissionPhase phase = model::MissionPhase::kRunning;
  model::Reference reference;
  /// The same of the load where several vehicles carry one; else `reference` and level.
  model::Reference load_reference;
  model::AttitudeReference load_attitude;
};

/// The end of a vehicle's own cable at a load that several vehicles carry.
struct CableEnd {
  Eigen::Quaterniond q_WL;                     ///< attitude of the load at step 0
  Eigen::Vector3d attachment_L;                ///< in the load, from its centre of mass, m
  std::optional<Eigen::Index> on_ground = {};  ///< the signal, of plants with a ground
};

/// That of a vehicle of `scenario`; none if it carries its load alone.
std::optional<CableEnd> find_cable_end(const config::Scenario& scenario, std::uint32_t vehicle_id);

class Mission {
 public:
  /// @throws config::ConfigError without a stage or without a positive period.
  /// With an `end`, the stages have the references of that end for a load as at step 0.
  Mission(const std::vector<config::Stage>& stages, std::int64_t period_ns,
          const std::optional<CableEnd>& end = {});

  /// True if `memory` names a stage, or the end of the mission, that began at `step` or earlier.
  bool is_possible(std::uint64_t step, const model::ControllerMemory& memory) const;

  /// Progress at `step`, from the memory accepted one step before, which must be possible at
  /// `step`. A finished mission stays finished, even if the body leaves the last stage's radius
  /// again. The mission fails when a stage reaches its timeout.
  MissionProgress calc_progress(std::uint64_t step, const model::Measurement& state,
                                const model::ControllerMemory& memory) const;

  /// The reference `time` seconds after a stage began.
  model::Reference calc_reference(std::uint32_t stage, double time) const;

  const std::string& stage_name(std::uint32_t stage) const { return stages_[stage].name; }

 private:
  struct Stage {
    std::string name;
    std::unique_ptr<const ReferenceTrajectory> trajectory;
    std::optional<AttitudeTrajectory> attitude;  // of a shared load
    config::LeaveCondition leave;
  };

  void calc_reference(const Stage& stage, double time, MissionProgress& progress) const;
  /// Time since `start_step`, whole nanoseconds; the largest number if it does not fit.
  std::int64_t calc_elapsed_ns(std::uint64_t step, std::uint64_t start_step) const;

  std::vector<Stage> stages_;
  std::int64_t period_ns_;
  std::optional<CableEnd> end_;
};

}  // namespace sls::control
