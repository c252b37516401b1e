/// Desired motions of the load. A new one derives from `ReferenceTrajectory` and gets a line in
/// `make_reference_trajectory`. Source: README.md, eqs. (12), (13), (17) and (18).
#pragma once

#include <Eigen/Geometry>
#include <memory>
#include <optional>

#include "common/config/scenario.hpp"
#include "common/model/reference.hpp"
#include "common/model/shared_load.hpp"

namespace sls::control {

/// A desired motion with exact derivatives up to the fourth.
class ReferenceTrajectory {
 public:
  virtual ~ReferenceTrajectory() = default;
  /// Reference `time` seconds after the stage began.
  virtual model::Reference calc(double time) const = 0;
};

/// Stays at one point.
class Constant : public ReferenceTrajectory {
 public:
  explicit Constant(const config::ConstantReference& config) : config_(config) {}
  model::Reference calc(double time) const override;

 private:
  config::ConstantReference config_;
};

/// A figure eight (∞) with one lap per `period_s`. Eq. (12).
class FigureEight : public ReferenceTrajectory {
 public:
  explicit FigureEight(const config::FigureEightReference& config) : config_(config) {}
  model::Reference calc(double time) const override;

 private:
  config::FigureEightReference config_;
};

/// From rest to rest on a straight line. Velocity, acceleration, jerk and snap are zero at both
/// ends. Before and after, the position is constant. Eq. (13).
class RestToRest : public ReferenceTrajectory {
 public:
  explicit RestToRest(const config::RestToRestReference& config) : config_(config) {}
  model::Reference calc(double time) const override;

 private:
  config::RestToRestReference config_;
};

std::unique_ptr<const ReferenceTrajectory> make_reference_trajectory(
    const config::StageReference& reference);

/// The desired attitude of a shared load in one stage. Eq. (17).
class AttitudeTrajectory {
 public:
  /// `q_start` is the load's attitude at step 0, which a stage without a key holds.
  AttitudeTrajectory(const config::StageReference& reference, const Eigen::Quaterniond& q_start);
  model::AttitudeReference calc(double time) const;
  /// False if the load is to keep the attitude of step 0.
  bool turns() const { return turns_; }

 private:
  void turn_to(const Eigen::Quaterniond& q_to, double duration_s);

  bool turns_ = false;
  Eigen::Quaterniond q_from_;
  Eigen::Vector3d axis_ = Eigen::Vector3d::UnitZ();  // in the load
  std::optional<RestToRest> angle_;                  // its x, rad; none: the load does not turn
};

/// The desired motion of the point `attachment_L` of a load whose centre of mass follows `load`.
/// Eq. (18).
model::Reference calc_end_reference(const model::Reference& load,
                                    const model::AttitudeReference& attitude,
                                    const Eigen::Vector3d& attachment_L);

}  // namespace sls::control
