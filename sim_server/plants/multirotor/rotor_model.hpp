/// The model of a rotor: its lag, and the forces it exerts. Source: README.md, eqs. (1) to (5),
/// (14), (15).
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "common/model/dot.hpp"
#include "common/model/math.hpp"
#include "sim_server/plants/multirotor/airframe.hpp"
#include "sim_server/plants/multirotor/rotor_speed.hpp"

namespace sls::sim {

/// First-order lag of a rotor behind its set-point, exact over steps of one length, 0 or more.
class RotorLag {
 public:
  RotorLag(const FlyingRotor& rotor, double step_s)
      : up_(rotor.lag_up, step_s), down_(rotor.lag_down, step_s) {}

  /// The speed just after the set-point has changed to `set_point`: without a lag it jumps.
  double begin(double speed, double set_point) const {
    return choose(speed, set_point).lag > 0.0 ? speed : set_point;
  }
  /// Speeds at the stages of a Runge-Kutta step. With these squares the impulse of the thrust and
  /// the distance it causes are exact: README.md, eqs. (14) and (15).
  struct Stages {
    RotorSpeed start, middle, end;
  };
  Stages find_stages(double speed, double set_point) const {
    const Way& way = choose(speed, set_point);
    const double off = speed - set_point, next = set_point + way.kept * off;
    const double steady = set_point * set_point, linear = 2.0 * set_point * off, square = off * off;
    const double mean = steady + linear * way.once.mean + square * way.twice.mean;
    const double early = 0.5 * steady + linear * way.once.early + square * way.twice.early;
    const double start = speed * speed;
    return {{speed, start},
            {set_point + way.kept_half * off, 3.0 * early - 0.5 * start},
            {next, 6.0 * mean - 12.0 * early + start}};
  }

 private:
  /// Means over x from 0 to 1: `mean` of e^(−a x), `early` of (1 − x) e^(−a x).
  struct Means {
    Means() = default;
    explicit Means(double a) {
      mean = a > 0.0 ? -math::expm1(-a) / a : 1.0;
      // The closed form loses digits for small a: use the series.
      constexpr double kSmall = 1e-2;
      early = a > kSmall ? (1.0 - mean) / a
                         : 1.0 / 2 - a * (1.0 / 6 - a * (1.0 / 24 - a * (1.0 / 120 - a / 720)));
    }
    double mean = 0.0, early = 0.0;
  };
  /// A deviation that decays from 1 with the time constant `lag`: its values after a step (`kept`)
  /// and half a step (`kept_half`).
  struct Way {
    Way(double lag_s, double step_s) : lag(lag_s) {
      if (lag == 0.0) return;
      kept = math::exp(-step_s / lag);
      kept_half = math::exp(-0.5 * step_s / lag);
      once = Means(step_s / lag);
      twice = Means(2.0 * step_s / lag);
    }
    double lag;
    double kept = 0.0, kept_half = 0.0;
    Means once, twice;  // of the deviation and of its square
  };
  const Way& choose(double speed, double set_point) const {
    return set_point > speed ? up_ : down_;
  }

  Way up_, down_;
};

/// Thrust of a rotor (N). The air passes along its axis with `axial_speed` (m/s, either sign).
inline double calc_thrust(const FlyingRotor& rotor, const RotorSpeed& turning, double axial_speed) {
  const double thrust = rotor.thrust_scale * (rotor.thrust_constant * turning.square);
  if (rotor.thrust_loss_speed == 0.0) return thrust;
  return thrust * std::max(0.0, 1.0 - std::abs(axial_speed) / rotor.thrust_loss_speed);
}

/// Loads of all rotors on the body.
struct RotorLoads {
  Eigen::Vector3d force_B = Eigen::Vector3d::Zero();   ///< N
  Eigen::Vector3d torque_B = Eigen::Vector3d::Zero();  ///< about the body's origin, N·m
  double thrust = 0.0;                                 ///< of all rotors, each along its axis, N
};

/// Adds the loads of one rotor. `v_WR_B` is the velocity of its hub through the air, in B, m/s.
inline void add_loads(const FlyingRotor& rotor, const RotorSpeed& turning,
                      const Eigen::Vector3d& v_WR_B, RotorLoads& loads) {
  const double axial_speed = model::dot(v_WR_B, rotor.axis_B);
  const double thrust = calc_thrust(rotor, turning, axial_speed);
  const Eigen::Vector3d v_across_B = v_WR_B - axial_speed * rotor.axis_B;
  const Eigen::Vector3d force_B =
      thrust * rotor.axis_B - turning.speed * rotor.drag_constant * v_across_B;
  loads.force_B += force_B;
  loads.torque_B += rotor.p_BR.cross(force_B) -
                    rotor.spin * rotor.torque_constant * thrust * rotor.axis_B -
                    turning.speed * rotor.rolling_constant * v_across_B;
  loads.thrust += thrust;
}

}  // namespace sls::sim
