/// The force of a vehicle whose cable is slack, or hangs where the law `qsf` does not hold. Source:
/// README.md, eqs. (12)–(16).
#pragma once

#include <optional>

#include "common/model/parameters.hpp"
#include "control_client/laws/control_law.hpp"
#include "control_client/laws/qsf/keys.hpp"

namespace sls::control {

/// Reads the signals of the vehicle's own cable.
class SlackRule {
 public:
  /// `gains` are those of the vertical axis, `retaut_rate` is c₀ in m/s, `released` the place of
  /// the signal, if the plant has it.
  SlackRule(const model::SlungLoadParameters& vehicle, const AxisGains& gains, double retaut_rate,
            double period, std::optional<Eigen::Index> released)
      : vehicle_(vehicle),
        gains_(gains),
        retaut_rate_(retaut_rate),
        period_(period),
        released_(released) {}

  /// Below this fraction of g the law needs the load to fall: the rule flies.
  static constexpr double kLeastSupport = 0.1;

  /// Least number of signals that the rule reads.
  Eigen::Index signals_size() const {
    return released_ ? *released_ + 1 : model::SharedLoad::kTaut + 1;
  }

  /// True where the law must not fly: the cable is slack, or the load hangs over 60° to the side.
  bool applies(const model::Measurement& state) const;

  /// f_Q_W (N), at most √5 m g, and never downwards.
  Eigen::Vector3d calc_force(const model::Measurement& state,
                             const model::Reference& reference) const;

 private:
  /// The cable, drawn straight from vehicle to load.
  struct Chord {
    explicit Chord(const model::Measurement& state);
    Eigen::Vector3d r_W, r_dot_W;  // m, m/s
    double distance;               // m
    Eigen::Vector3d n_W = Eigen::Vector3d::UnitZ();
  };
  Eigen::Vector3d limit_rate(const Eigen::Vector3d& a_W, const Chord& chord) const;

  model::SlungLoadParameters vehicle_;
  AxisGains gains_;
  double retaut_rate_;  // m/s
  double period_;       // s
  std::optional<Eigen::Index> released_;
};

}  // namespace sls::control
