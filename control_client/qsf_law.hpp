/// Quasi-static feedback linearisation: the load follows its reference as if it were three
/// independent integrator chains. Source: README.md, eqs. (1)–(9).
#pragma once

#include "common/config/scenario.hpp"
#include "common/model/parameters.hpp"
#include "control_client/control_law.hpp"

namespace sls::control {

/// The law is singular where s = g − n₃ vanishes; below this fraction of g it reports kFreeFall.
inline constexpr double kMinSupportFraction = 1e-3;

/// It is singular where the rod is level; below this cos α or cos β (0.06° from level) it reports
/// kRodLevel. So it does with the load above the quadrotor, where the cosines are negative.
inline constexpr double kMinRodCosine = 1e-3;

/// Force on the quadrotor that makes the load error obey the designed linear equations, for a
/// vehicle with the parameters `vehicle`. Set-point, tracking and integral variant in one.
/// Holds for |α|, |β| < π/2 and s > 0; outside it reports a fault and no force, never NaN.
/// Source: README.md, eqs. (1)–(9).
LawOutput calc_qsf(const LawInput& input, const model::SlungLoadParameters& vehicle,
                   const config::NamedGains& gains);

/// The same as a `ControlLaw`.
class QsfLaw : public ControlLaw {
 public:
  QsfLaw(const model::SlungLoadParameters& vehicle, const config::NamedGains& gains)
      : vehicle_(vehicle), gains_(gains) {}

  LawOutput calc(const LawInput& input) const override { return calc_qsf(input, vehicle_, gains_); }

 private:
  model::SlungLoadParameters vehicle_;
  config::NamedGains gains_;
};

}  // namespace sls::control
