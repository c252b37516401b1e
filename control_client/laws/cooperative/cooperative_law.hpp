/// Several vehicles hold the position and the attitude of one load. Each computes its own force
/// from the motion of the load and its own cable. Source: README.md.
#pragma once

#include <Eigen/Core>
#include <cstddef>

#include "common/model/parameters.hpp"
#include "control_client/laws/control_law.hpp"
#include "control_client/laws/cooperative/distribution.hpp"
#include "control_client/laws/cooperative/keys.hpp"

namespace sls::control {

/// A vector with its first and second derivative with respect to time.
struct Jet {
  Eigen::Vector3d value, first, second;
};

/// The designed motion of the load, and the cable force that one vehicle owes to it.
struct CooperativePlan {
  Eigen::Matrix3d R_WL;  ///< attitude of the load
  Eigen::Vector3d a_WL;  ///< of the load's centre of mass, m/s²: n of eq. (2)
  Jet w_L;               ///< rates of the load, in the load, and their derivatives: eq. (5)
  Jet force_L;           ///< on the load, N
  Jet moment_L;          ///< on the load, N·m
  Jet pull_W;            ///< of the own cable on the load, N: eq. (9)
};

/// Its memory is empty. Holds while cos α and cos β of the own cable are positive and its wanted
/// tension pulls upwards; outside it reports an error code and no force, never NaN.
class CooperativeLaw : public ControlLaw {
 public:
  /// `believed` are those of the own vehicle. The load is as much heavier than the true one as its
  /// believed share.
  CooperativeLaw(const model::SharedLoad& load, std::size_t vehicle,
                 const model::SlungLoadParameters& believed, const CooperativeKeys& keys);

  LawOutput calc(const LawInput& input) const override;
  /// Eqs. (1) to (9). The signals of `input` are those of a shared load.
  CooperativePlan calc_plan(const LawInput& input) const;

 private:
  /// The load as the own cable's end shows it.
  struct Load {
    Eigen::Vector3d p_WL, v_WL;
    Eigen::Matrix3d R_WL;
    Eigen::Vector3d w_L;
  };
  Load find_load(const model::Measurement& state) const;
  void plan_position(const Load& load, const LawInput& input, CooperativePlan& plan) const;
  void plan_attitude(const Load& load, const LawInput& input, CooperativePlan& plan) const;

  const std::size_t vehicle_;
  const model::SlungLoadParameters believed_;
  const CooperativeGains gains_;
  const bool is_rigid_;
  const Eigen::Vector3d attachment_L_;
  const Distribution distribution_;
  double load_mass_ = 0.0;                                // kg
  Eigen::Matrix3d inertia_L_ = Eigen::Matrix3d::Zero();   // kg·m²
  Eigen::Vector3d internal_L_ = Eigen::Vector3d::Zero();  // of the own cable, N
};

}  // namespace sls::control
