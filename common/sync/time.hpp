#pragma once

#include <chrono>

namespace sls::sync {

/// A moment of awake time (common/app/awake_clock.hpp). The rules of synchronisation get it as an
/// argument and ask no clock, so a test can choose it.
using Time = std::chrono::steady_clock::time_point;
using Duration = Time::duration;

inline double to_seconds(Duration duration) {
  return std::chrono::duration<double>(duration).count();
}

inline Duration to_duration(double seconds) {
  return std::chrono::duration_cast<Duration>(std::chrono::duration<double>(seconds));
}

}  // namespace sls::sync
