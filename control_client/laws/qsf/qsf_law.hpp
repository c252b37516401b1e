/// Quasi-static feedback linearisation: the load follows its reference as if it were three
/// independent integrator chains. Source: README.md, eqs. (1)–(9).
#pragma once

#include <optional>

#include "common/model/parameters.hpp"
#include "control_client/laws/control_law.hpp"
#include "control_client/laws/qsf/keys.hpp"
#include "control_client/laws/qsf/slack.hpp"

namespace sls::control {

/// The inputs of the law.
struct QsfInput {
  Eigen::Vector3d p_WQ = Eigen::Vector3d::Zero();  ///< m
  Eigen::Vector3d v_WQ = Eigen::Vector3d::Zero();  ///< m/s
  model::RodAngles rod;                            ///< as wired to the controller's slots
  const model::Reference& reference;
  Eigen::Vector3d integral = Eigen::Vector3d::Zero();  ///< ∫e dt, m·s
  double least_support = kMinSupportFraction;          ///< of g; below it s is free fall
};

struct QsfOutput {
  Eigen::Vector3d f_Q_W = Eigen::Vector3d::Zero();       ///< N; zero with an error code
  Eigen::Vector3d load_error = Eigen::Vector3d::Zero();  ///< e = y − y_r by the law's own model, m
  Eigen::Vector3d integral_rate = Eigen::Vector3d::Zero();  ///< e where e is integrated, else 0, m
  ErrorCode error_code = ErrorCode::kNone;
};

/// Force on the quadrotor that makes the load error obey the designed linear equations, for a
/// vehicle with the parameters `vehicle`. Contains the set-point, tracking and integral variants.
/// Holds for |α|, |β| < π/2 and s > 0; outside it reports an error code and no force, never NaN.
/// Source: README.md, eqs. (1)–(9).
QsfOutput calc_qsf(const QsfInput& input, const model::SlungLoadParameters& vehicle,
                   const NamedGains& gains);

/// The same as a `ControlLaw`. Its memory is the integral. `slack` flies where the cable is slack
/// and where the law does not hold; without it these are errors.
class QsfLaw : public ControlLaw {
 public:
  QsfLaw(const model::SlungLoadParameters& vehicle, const NamedGains& gains, double period,
         const std::optional<SlackRule>& slack = {})
      : vehicle_(vehicle), gains_(gains), period_(period), slack_(slack) {}

  LawOutput calc(const LawInput& input) const override;
  int memory_size() const override { return 3; }

 private:
  model::SlungLoadParameters vehicle_;
  NamedGains gains_;
  double period_;  // s
  std::optional<SlackRule> slack_;
};

}  // namespace sls::control
