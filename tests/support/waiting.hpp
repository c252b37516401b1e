#pragma once

#include <chrono>
#include <functional>
#include <thread>

namespace sls::test {

/// Waits until `is_met`, at most `limit`; false if it never was. The limit only says when to call
/// it a failure, on a slow and busy machine too (discovery alone took more than 3 s once in 100
/// runs).
inline bool wait_until(const std::function<bool()>& is_met,
                       std::chrono::milliseconds limit = std::chrono::seconds(60)) {
  const auto deadline = std::chrono::steady_clock::now() + limit;
  while (!is_met()) {
    if (std::chrono::steady_clock::now() >= deadline) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
  return true;
}

}  // namespace sls::test
