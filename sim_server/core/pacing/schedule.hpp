/// When the states of a real-time run are due, on the monotonic clock. No waiting here.
#pragma once

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <optional>

namespace sls::sim {

/// An absolute schedule: step k is due k wall periods after the origin. Delays of earlier steps do
/// not move it, so errors do not add up.
class Schedule {
 public:
  using Clock = std::chrono::steady_clock;

  /// If the server is behind by more than both limits, the schedule moves.
  static constexpr int kMaxPeriodsBehind = 10;
  static constexpr auto kMaxTimeBehind = std::chrono::milliseconds(50);

  /// Step 0 is due at `origin`; `period` is wall time, the control period over the real-time
  /// factor.
  Schedule(Clock::time_point origin, std::chrono::duration<double, std::nano> period)
      : origin_(origin), period_(period) {}

  Clock::time_point due(std::uint64_t step) const {
    return origin_ + std::chrono::duration_cast<Clock::duration>(period_ * step);
  }

  /// When to close `step`, whose state was published at `published`: when the next step is due, but
  /// at least a quarter of a period after `published`, also while the server catches up.
  Clock::time_point close(std::uint64_t step, Clock::time_point published) const {
    return std::max(due(step + 1),
                    published + std::chrono::duration_cast<Clock::duration>(period_ / 4));
  }

  /// Moves the schedule if `step` is too late at `now`. Returns the lost time, or nothing.
  std::optional<Clock::duration> slip(std::uint64_t step, Clock::time_point now) {
    const auto behind = now - due(step);
    if (behind <= period_ * kMaxPeriodsBehind || behind <= kMaxTimeBehind) return std::nullopt;
    origin_ += behind;
    return behind;
  }

  /// Moves the schedule by the time for which the run rested.
  void pause(Clock::duration rest) { origin_ += rest; }

 private:
  Clock::time_point origin_;
  std::chrono::duration<double, std::nano> period_;
};

}  // namespace sls::sim
