#pragma once

#include <algorithm>
#include <chrono>

namespace sls::bus {

/// Looks for something for a while, before its caller sleeps until it is there. Waking a thread on
/// a halted processor takes longer than a step of the loop.
///
/// Looking in vain costs time that the sender may need. So after a failure the next wait sleeps at
/// once, after a second one in a row the next three, and so on; each success halves their number.
/// Where the sender shares our processor, is far away or has much to do, hardly anybody looks.
class AdaptiveSpin {
 public:
  using Clock = std::chrono::steady_clock;

  static constexpr std::chrono::microseconds kLongest{100};
  static constexpr int kMostSkipped = 1023;

  /// `looks_per_time`: how often to look between two looks at the clock.
  explicit AdaptiveSpin(int looks_per_time) : looks_per_time_(looks_per_time) {}

  /// True as soon as `is_there()` is; false after `kLongest`, or at once if this wait is skipped.
  template <class Condition>
  bool wait_for(Condition is_there) {
    if (skipped_ < to_skip_) {
      ++skipped_;
      return false;
    }
    skipped_ = 0;
    const auto end = Clock::now() + kLongest;
    do {
      for (int i = 0; i < looks_per_time_; ++i) {
        if (is_there()) {
          to_skip_ /= 2;
          return true;
        }
        rest();
      }
    } while (Clock::now() < end);
    to_skip_ = std::min(2 * to_skip_ + 1, kMostSkipped);
    return false;
  }

 private:
  /// Leaves the core to its other hardware thread for some ten cycles. Not sched_yield: where
  /// others want the processor too, the thread then gets it back a time slice later.
  static void rest() {
#if defined(__x86_64__) || defined(__i386__)
    __builtin_ia32_pause();
#elif defined(__aarch64__)
    asm volatile("yield");
#endif
  }

  int looks_per_time_;
  int to_skip_ = 0;  ///< waits between two that look
  int skipped_ = 0;
};

}  // namespace sls::bus
