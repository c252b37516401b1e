/// Which step of the plant a group of sensors shows: README.md, eqs. (1) and (2).
#pragma once

#include <cstdint>
#include <limits>

#include "common/config/scenario.hpp"

namespace sls::sim {

class SampleClock {
 public:
  /// `step_ns` > 0 is the step of the plant.
  SampleClock(const config::SampleTimes& times, std::int64_t step_ns)
      : times_(times), step_ns_(step_ns) {}

  /// The step whose state is seen at `step`. Source: README.md, eqs. (1) and (2).
  std::int64_t find_seen(std::int64_t step) const;

  /// The first step after `step` whose state the sensors can show later. kNever if they always show
  /// the current state.
  std::int64_t find_next_sample(std::int64_t step) const;

  static constexpr std::int64_t kNever = std::numeric_limits<std::int64_t>::max();

 private:
  config::SampleTimes times_;
  std::int64_t step_ns_;
};

/// True if a sample shown at a multiple of the control period `period_ns` can be older than that.
bool is_ever_old(const config::SampleTimes& times, std::int64_t period_ns);

/// Steps until a force with the delay `delay_ns` acts. Source: README.md, eq. (3).
std::int64_t calc_delay_steps(std::int64_t delay_ns, std::int64_t step_ns);

}  // namespace sls::sim
