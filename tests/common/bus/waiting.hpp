#pragma once

#include <chrono>
#include <functional>
#include <thread>

namespace sls::bus::test {

/// Waits until `is_met`, at most 10 s (discovery took more than 3 s once in 100 runs).
inline bool wait_until(const std::function<bool()>& is_met,
                       std::chrono::milliseconds limit = std::chrono::seconds(10)) {
  const auto deadline = std::chrono::steady_clock::now() + limit;
  while (!is_met()) {
    if (std::chrono::steady_clock::now() >= deadline) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
  return true;
}

}  // namespace sls::bus::test
