/// How the cables of a group share the force and the moment on their load. Source: README.md, eqs.
/// (6) to (8).
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "common/model/shared_load.hpp"

namespace sls::control {

/// True if the cables can exert any moment: not all attachments are on one line (within 0.1 % of
/// their extent).
bool can_turn(const model::SharedLoad& load);

class Distribution {
 public:
  /// Of a rigid load that `can_turn`, or of a point, which bears no moment.
  explicit Distribution(const model::SharedLoad& load);

  /// The forces of all cables on the load whose sum is `force_L` (N), whose moment about the centre
  /// of mass is `moment_L` (N·m), and whose sum of squares is least: that of `cable`, N. Eq. (6).
  Eigen::Vector3d calc_share(std::size_t cable, const Eigen::Vector3d& force_L,
                             const Eigen::Vector3d& moment_L) const;

  /// Forces of all cables without sum and moment. They pull the outermost cable `outwards` (N),
  /// level in the load, and the others in proportion to their distance from the middle. Those of a
  /// point are equal, towards the corners of a regular polygon. Eqs. (7) and (8).
  std::vector<Eigen::Vector3d> calc_internal(double outwards) const;

 private:
  bool is_rigid_;
  Eigen::Vector3d middle_L_ = Eigen::Vector3d::Zero();  // of the attachments, m
  std::vector<Eigen::Vector3d> arms_L_;                 // of the attachments, from their middle, m
  Eigen::Matrix3d inverse_;                             // S⁻¹, 1/m²
};

}  // namespace sls::control
