/// Desired motions of the load. A new one derives from `ReferenceTrajectory` and gets a line in
/// `make_reference_trajectory`. Source: README.md, eqs. (12) and (13).
#pragma once

#include <memory>

#include "common/config/scenario.hpp"
#include "common/model/reference.hpp"

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

}  // namespace sls::control
