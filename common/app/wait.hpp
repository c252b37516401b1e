#pragma once

#include <chrono>

namespace sls::app {

/// Interval of the waiting loops of the programs, which are not urgent.
inline constexpr auto kPollTime = std::chrono::milliseconds(20);

/// The same before the first step and after the last one: a flight can be shorter than these waits.
inline constexpr auto kShortPollTime = std::chrono::milliseconds(5);

/// Discovery and claim usually take less: a program that joins a run reports its waiting after
/// this.
inline constexpr auto kUsualJoinTime = std::chrono::milliseconds(1500);

/// The times of a wait: its deadline, and when to log a line about it.
class Wait {
 public:
  using Clock = std::chrono::steady_clock;

  /// Begins now and lasts `timeout_s` seconds; it is first reported after `quiet_time`.
  explicit Wait(double timeout_s, Clock::duration quiet_time = std::chrono::seconds(1))
      : timeout_(
            std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(timeout_s))),
        deadline_(Clock::now() + timeout_),
        next_report_(Clock::now() + quiet_time) {}

  /// Starts the timeout again. The times of the reports do not change.
  void renew() { deadline_ = Clock::now() + timeout_; }

  /// Moves deadline and next report by `rest`, a time that does not count, such as a pause.
  void extend(Clock::duration rest) {
    deadline_ += rest;
    next_report_ += rest;
  }

  bool is_over() const { return Clock::now() >= deadline_; }

  /// True if a line about the wait is due: once after the quiet time, then every 5 s.
  bool is_report_due() {
    const auto now = Clock::now();
    if (now < next_report_) return false;
    next_report_ = now + kReportInterval;
    return true;
  }

  double seconds_left() const {
    return std::chrono::duration<double>(deadline_ - Clock::now()).count();
  }

 private:
  static constexpr auto kReportInterval = std::chrono::seconds(5);

  Clock::duration timeout_;
  Clock::time_point deadline_;
  Clock::time_point next_report_;
};

}  // namespace sls::app
