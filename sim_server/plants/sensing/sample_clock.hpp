/// Which step of the plant a group of sensors shows: README.md, eqs. (1) and (2).
#pragma once

#include <cstdint>
#include <limits>

#include "common/config/scenario.hpp"

namespace sls::sim {

constexpr std::int64_t divide_up(std::int64_t number, std::int64_t by) {
  return (number + by - 1) / by;
}

class SampleClock {
 public:
  /// `step_ns` > 0 is the step of the plant.
  SampleClock(const config::SampleTimes& times, std::int64_t step_ns)
      : times_(times), step_ns_(step_ns) {}

  /// The step whose state is seen at `step`. Source: README.md, eqs. (1) and (2).
  std::int64_t find_seen(std::int64_t step) const {
    const std::int64_t arrived_ns =
        step * step_ns_ - times_.age_ns;  // samples up to it have arrived
    if (arrived_ns < 0) return 0;
    if (times_.period_ns == 0) return arrived_ns / step_ns_;
    const std::int64_t sample = arrived_ns / times_.period_ns;  // Eq. (1)
    return sample * times_.period_ns / step_ns_;                // Eq. (2)
  }

  /// The first step after `step` whose state the sensors can show later. kNever if they always show
  /// the current state.
  std::int64_t find_next_sample(std::int64_t step) const {
    if (times_.period_ns == 0) return times_.age_ns == 0 ? kNever : step + 1;
    const std::int64_t sample = divide_up((step + 1) * step_ns_, times_.period_ns);
    return sample * times_.period_ns / step_ns_;
  }

  static constexpr std::int64_t kNever = std::numeric_limits<std::int64_t>::max();

 private:
  config::SampleTimes times_;
  std::int64_t step_ns_;
};

/// True if a sample shown at a multiple of the control period `period_ns` can be older than that.
inline bool is_ever_old(const config::SampleTimes& times, std::int64_t period_ns) {
  return times.age_ns > 0 || (times.period_ns > 0 && period_ns % times.period_ns != 0);
}

/// Steps until a force with the delay `delay_ns` acts. Source: README.md, eq. (3).
inline std::int64_t calc_delay_steps(std::int64_t delay_ns, std::int64_t step_ns) {
  return divide_up(delay_ns, step_ns);
}

}  // namespace sls::sim
