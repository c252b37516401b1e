#pragma once

#include <chrono>

#include "common/app/awake_clock.hpp"
#include "common/sync/patience.hpp"

namespace sls::app {

/// Interval of the waiting loops of the programs, which are not urgent.
inline constexpr auto kPollTime = std::chrono::milliseconds(20);

/// The same before the first step and after the last one: a flight can be shorter than these waits.
inline constexpr auto kShortPollTime = std::chrono::milliseconds(5);

/// Sleeps until `due`, of awake time: the next look of the main thread. Logs a stop of the program
/// before it, which is nobody's silence.
void sleep_until(sync::Time due);
/// As sleep_until, for `duration`.
void sleep_for(sync::Duration duration);
/// Ends with a loop that sleeps by sleep_until, in a process that does other things afterwards.
struct LookedAfter {
  ~LookedAfter() { app::awake_clock().expect_no_look(); }
};
/// Logs for how long the program was stopped since the last call, if it was.
void log_stop();

/// sync::Patience that asks the clock.
class Wait {
 public:
  /// Begins now and lasts `timeout_s` seconds; it is first reported after `quiet_time`.
  explicit Wait(double timeout_s, sync::Duration quiet_time = std::chrono::seconds(1))
      : patience_(now(), timeout_s, quiet_time) {}

  void renew() { patience_.renew(now()); }
  void extend(sync::Duration rest) { patience_.extend(rest); }
  bool is_over() const { return patience_.is_over(now()); }
  bool is_report_due() { return patience_.is_report_due(now()); }
  double seconds_left() const { return patience_.seconds_left(now()); }

 private:
  static sync::Time now() { return app::awake_clock().now(); }

  sync::Patience patience_;
};

}  // namespace sls::app
