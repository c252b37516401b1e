/// When, within a step, a value changes its sign: the search for events. README.md, "Events".
#pragma once

#include <algorithm>
#include <cmath>

namespace sls::sim::cables {

inline constexpr double kTimeTolerance = 1e-13;  ///< of a located event, s

/// The end of an interval of at most kTimeTolerance in which `value` becomes positive: between
/// `low`, where it is not, and `high`, where it is. Regula falsi (Illinois), every third time
/// bisection.
template <class Value>
double find_crossing(const Value& value, double low, double at_low, double high, double at_high) {
  int side = 0;
  for (int i = 0; i < 150 && high - low > kTimeTolerance; ++i) {
    double time = (low * at_high - high * at_low) / (at_high - at_low);
    if (i % 3 == 2 || !(time > low && time < high)) time = 0.5 * (low + high);
    const double found = value(time);
    if (found > 0.0) {
      high = time;
      at_high = found;
      if (side == 1) at_low *= 0.5;
      side = 1;
    } else {
      low = time;
      at_low = found;
      if (side == -1) at_high *= 0.5;
      side = -1;
    }
  }
  return high;
}

/// A value and its derivative by time.
struct Slope {
  double value, rate;
};

/// When a value rises above 0, within kTimeTolerance or where it is less than `rounding`. It is
/// that of `start` at 0, from where it can fall first, and `at_high` > 0 at `high`. Newton's method
/// from the parabola through these, and bisection where that leaves the interval.
template <class Find>
double find_rise(const Find& find, const Slope& start, double high, double at_high,
                 double rounding) {
  const double bend = (at_high - start.value - high * start.rate) / (high * high);
  const double root = start.rate * start.rate - 4.0 * bend * start.value;
  double time = 0.5 * (std::sqrt(std::max(root, 0.0)) - start.rate) / bend;
  double low = 0.0;
  for (int i = 0; i < 150 && high - low > kTimeTolerance; ++i) {
    if (!(time > low && time < high)) time = 0.5 * (low + high);
    const Slope at = find(time);
    if (at.rate > 0.0 && std::abs(at.value) <= rounding) return time;
    (at.value > std::max(start.value, 0.0) ? high : low) = time;
    time -= at.value / at.rate;
  }
  return high;
}

/// Of two lines, with value and slope at 0 and at 1, the value where they cross.
inline double calc_tangents_crossing(double at_0, double slope_0, double at_1, double slope_1) {
  return at_0 + slope_0 * (at_1 - at_0 - slope_1) / (slope_0 - slope_1);
}

}  // namespace sls::sim::cables
