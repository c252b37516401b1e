#include "common/app/wait.hpp"

#include <spdlog/spdlog.h>

#include <atomic>
#include <thread>

namespace sls::app {

void sleep_until(sync::Time due) {
  AwakeClock& clock = awake_clock();
  clock.expect_look(due);
  std::this_thread::sleep_until(clock.to_steady(due));
  clock.now();
  log_stop();
}

void sleep_for(sync::Duration duration) { sleep_until(awake_clock().now() + duration); }

void log_stop() {
  constexpr auto kWorthALine = std::chrono::milliseconds(500);
  static std::atomic<sync::Duration> logged{sync::Duration(0)};
  const sync::Duration stopped = awake_clock().stopped();
  sync::Duration before = logged;
  if (stopped - before >= kWorthALine && logged.compare_exchange_strong(before, stopped))
    spdlog::warn("this program was stopped for {:.1f} s, which counts as nobody's silence",
                 sync::to_seconds(stopped - before));
}

}  // namespace sls::app
