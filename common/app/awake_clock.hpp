#pragma once

#include <algorithm>
#include <atomic>
#include <chrono>
#include <mutex>

#include "common/sync/time.hpp"

namespace sls::app {

/// Awake time: a monotonic clock without the times in which this program was stopped, by SIGSTOP,
/// a paused container, a suspended or a starved machine. A stopped program hears and decides
/// nothing, so such a time is nobody's silence. Every deadline of the cores is in awake time.
///
/// The program's main thread says when it will look next. If any thread looks more than
/// kLongestLook after that, the program was stopped since the look before. So no deadline passes
/// before what came during the stop has been read. A program that says nothing has plain steady
/// time. All functions may be called on any thread.
class AwakeClock {
 public:
  /// A look too late by more than this is a stop; less is the scheduler.
  static constexpr sync::Duration kLongestLook = std::chrono::milliseconds(200);

  /// A look at `steady`, a time of the steady clock: returns its awake time.
  sync::Time look(sync::Time steady) {
    const auto time = steady.time_since_epoch().count();
    if (time - due_ > kLongestLook.count()) note_stop(time);
    for (auto last = looked_.load(); last < time && !looked_.compare_exchange_weak(last, time);) {
    }
    return steady - stopped();
  }

  /// A look now. Never earlier than one before.
  sync::Time now() {
    while (true) {
      const sync::Duration before = stopped();
      const sync::Time time = look(std::chrono::steady_clock::now());
      if (stopped() == before) return time;
    }
  }

  /// The next look of the main thread is at `due`, of awake time.
  void expect_look(sync::Time due) { due_ = (due + stopped()).time_since_epoch().count(); }

  /// The main thread looks no more: from now on this is steady time.
  void expect_no_look() { due_ = sync::Duration::max().count(); }

  /// `awake` as a time of the steady clock, unless the program is stopped until then.
  sync::Time to_steady(sync::Time awake) const { return awake + stopped(); }

  /// For how long the program was stopped so far.
  sync::Duration stopped() const { return sync::Duration(stopped_); }

 private:
  void note_stop(sync::Duration::rep time) {
    const std::lock_guard lock(mutex_);
    if (time - due_ <= kLongestLook.count()) return;  // another thread was first
    stopped_ += std::max<sync::Duration::rep>(time - looked_, 0);
    looked_ = due_ = time;
  }

  std::mutex mutex_;
  std::atomic<sync::Duration::rep> due_{sync::Duration::max().count()};  // of the steady clock
  std::atomic<sync::Duration::rep> looked_{0};                           // likewise
  std::atomic<sync::Duration::rep> stopped_{0};
};

/// The clock of this process.
inline AwakeClock& awake_clock() {
  static AwakeClock clock;
  return clock;
}

}  // namespace sls::app
