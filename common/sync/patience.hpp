#pragma once

#include "common/sync/time.hpp"

namespace sls::sync {

/// Discovery and claim usually take less: a program that joins a run reports its waiting after
/// this.
inline constexpr auto kUsualJoinTime = std::chrono::milliseconds(1500);

/// The times of a wait: its deadline, and when to log a line about it.
class Patience {
 public:
  /// Begins at `now` and lasts `timeout_s` seconds; it is first reported after `quiet_time`.
  Patience(Time now, double timeout_s, Duration quiet_time = std::chrono::seconds(1))
      : timeout_(to_duration(timeout_s)),
        deadline_(now + timeout_),
        next_report_(now + quiet_time) {}

  /// Starts the timeout again. The times of the reports do not change.
  void renew(Time now) { deadline_ = now + timeout_; }

  /// Moves deadline and next report by `rest`, a time that does not count, such as a pause.
  void extend(Duration rest) {
    deadline_ += rest;
    next_report_ += rest;
  }

  bool is_over(Time now) const { return now >= deadline_; }

  /// True if a line about the wait is due: once after the quiet time, then every 5 s.
  bool is_report_due(Time now) {
    if (now < next_report_) return false;
    next_report_ = now + kReportInterval;
    return true;
  }

  double seconds_left(Time now) const { return to_seconds(deadline_ - now); }

 private:
  static constexpr auto kReportInterval = std::chrono::seconds(5);

  Duration timeout_;
  Time deadline_;
  Time next_report_;
};

}  // namespace sls::sync
