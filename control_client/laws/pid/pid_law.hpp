/// A cascaded law without feed-forward: position, velocity, rod angle. This is the usual law of
/// multirotors with a load, for comparison with QSF. Source: README.md, eqs. (1)–(5).
#pragma once

#include "common/model/parameters.hpp"
#include "control_client/laws/control_law.hpp"
#include "control_client/laws/pid/keys.hpp"

namespace sls::control {

class PidLaw : public ControlLaw {
 public:
  PidLaw(const model::SlungLoadParameters& vehicle, const PidGains& gains, double period)
      : vehicle_(vehicle), gains_(gains), period_(period) {}

  /// Holds for |α|, |β| < π/2 and a desired vertical acceleration below g; outside it reports an
  /// error code and no force, never NaN.
  LawOutput calc(const LawInput& input) const override;
  /// The integral of the position error, m·s.
  int memory_size() const override { return 3; }

 private:
  model::SlungLoadParameters vehicle_;
  PidGains gains_;
  double period_;  // s
};

}  // namespace sls::control
