#pragma once

#include <algorithm>
#include <chrono>

namespace sls::bus {

/// Polls a condition for a while before the caller sleeps, because waking a thread on a halted
/// processor takes longer than a step of the loop.
///
/// Polling in vain takes time that the sender may need. So after a failure the next wait sleeps at
/// once, after a second failure in a row the next three waits, and so on; each success halves this
/// number. There is hardly any polling if the sender shares our processor, is far away or is busy.
class AdaptiveSpin {
 public:
  using Clock = std::chrono::steady_clock;

  static constexpr std::chrono::microseconds kLongest{100};
  static constexpr int kMostSkipped = 1023;

  /// `looks_per_time`: number of polls between two readings of the clock.
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
  /// Leaves the core to its other hardware thread for some ten cycles. Not sched_yield: if other
  /// threads are ready, this thread would run again only a time slice later.
  static void rest() {
#if defined(__x86_64__) || defined(__i386__)
    __builtin_ia32_pause();
#elif defined(__aarch64__)
    asm volatile("yield");
#endif
  }

  int looks_per_time_;
  int to_skip_ = 0;  ///< waits without polling between two with polling
  int skipped_ = 0;
};

}  // namespace sls::bus
