#pragma once

#include <sys/types.h>

#include <chrono>
#include <fstream>
#include <functional>
#include <string>
#include <thread>

namespace sls::test {

/// Waits until `is_met`, at most `limit`. @returns false at the limit. The default is long, because
/// a test must not fail on a slow and busy machine (discovery alone took more than 3 s once in 100
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

/// State of a process or thread: R running, S sleeping, T stopped; ? if there is none.
inline char find_state(pid_t id) {
  std::ifstream stat("/proc/" + std::to_string(id) + "/stat");
  std::string line;
  std::getline(stat, line);
  const auto name_end = line.rfind(") ");
  return name_end == std::string::npos ? '?' : line.at(name_end + 2);
}

}  // namespace sls::test
