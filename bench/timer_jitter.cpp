#include "bench/timer_jitter.hpp"

#include <chrono>
#include <nlohmann/json.hpp>
#include <thread>

#include "bench/latencies.hpp"
#include "common/app/stop_signal.hpp"

namespace sls::bench {

nlohmann::json measure_timer(double period_s, double seconds) {
  using Clock = std::chrono::steady_clock;
  const std::chrono::duration<double> period(period_s);
  const auto count = static_cast<std::int64_t>(seconds / period_s);
  const auto began = Clock::now();
  Latencies latencies;
  for (std::int64_t k = 1; k <= count && app::stop_signal() == 0; ++k) {
    const auto due = began + std::chrono::duration_cast<Clock::duration>(period * k);
    std::this_thread::sleep_until(due);
    latencies.add(Clock::now() - due);
  }
  return latencies.to_json();
}

}  // namespace sls::bench
