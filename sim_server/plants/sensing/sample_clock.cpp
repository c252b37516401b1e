#include "sim_server/plants/sensing/sample_clock.hpp"

namespace sls::sim {
namespace {

std::int64_t divide_up(std::int64_t number, std::int64_t by) { return (number + by - 1) / by; }

}  // namespace

std::int64_t SampleClock::find_seen(std::int64_t step) const {
  const std::int64_t arrived_ns = step * step_ns_ - times_.age_ns;  // samples up to it have arrived
  if (arrived_ns < 0) return 0;
  if (times_.period_ns == 0) return arrived_ns / step_ns_;
  const std::int64_t sample = arrived_ns / times_.period_ns;  // Eq. (1)
  return sample * times_.period_ns / step_ns_;                // Eq. (2)
}

std::int64_t SampleClock::find_next_sample(std::int64_t step) const {
  if (times_.period_ns == 0) return times_.age_ns == 0 ? kNever : step + 1;
  const std::int64_t sample = divide_up((step + 1) * step_ns_, times_.period_ns);
  return sample * times_.period_ns / step_ns_;
}

bool is_ever_old(const config::SampleTimes& times, std::int64_t period_ns) {
  return times.age_ns > 0 || (times.period_ns > 0 && period_ns % times.period_ns != 0);
}

std::int64_t calc_delay_steps(std::int64_t delay_ns, std::int64_t step_ns) {
  return divide_up(delay_ns, step_ns);
}

}  // namespace sls::sim
