#pragma once

#include <chrono>
#include <utility>

namespace sls::sync {

/// A moment on a monotonic clock. The rules of synchronisation get it as an argument and ask no
/// clock, so a test can choose it.
using Time = std::chrono::steady_clock::time_point;
using Duration = Time::duration;

/// The longest time between two looks of a program that runs: after a longer one it was stopped.
inline constexpr Duration kLongestLook = std::chrono::milliseconds(500);

/// Notes a look at `now`. Returns for how long the program was stopped before it; 0 if it ran.
inline Duration note_look(Time& looked, Time now) {
  const Duration pass = now - std::exchange(looked, now);
  return pass > kLongestLook ? pass : Duration::zero();
}

inline double to_seconds(Duration duration) {
  return std::chrono::duration<double>(duration).count();
}

inline Duration to_duration(double seconds) {
  return std::chrono::duration_cast<Duration>(std::chrono::duration<double>(seconds));
}

}  // namespace sls::sync
