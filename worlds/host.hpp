#pragma once

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <deque>
#include <functional>
#include <string>
#include <utility>

#include "common/sync/time.hpp"
#include "worlds/timeline.hpp"

namespace sls::worlds {

/// A machine with its clocks, which are not those of the others.
class Host {
 public:
  using Wall = std::chrono::system_clock::time_point;

  /// `drift`: of both clocks, s per s. `wall_offset`: of the wall clock.
  Host(const Timeline& timeline, std::string name, std::chrono::nanoseconds uptime, double drift,
       std::chrono::nanoseconds wall_offset)
      : timeline_(timeline),
        name_(std::move(name)),
        uptime_(uptime),
        drift_(drift),
        wall_offset_(wall_offset) {}

  const std::string& name() const { return name_; }
  sync::Time now() const { return sync::Time(uptime_ + calc_elapsed()); }
  Wall wall() const {
    return Wall(std::chrono::duration_cast<Wall::duration>(kEpoch + calc_elapsed() + wall_offset_));
  }
  void set_wall_clock(std::chrono::nanoseconds jump) {
    wall_offset_ += jump;
    has_jumped_ = true;
  }
  bool has_jumped() const { return has_jumped_; }
  /// The moment of the world at which this host's monotonic clock shows `time`; never too early.
  Instant find(sync::Time time) const {
    const double elapsed = static_cast<double>((time.time_since_epoch() - uptime_).count());
    return Instant(static_cast<std::int64_t>(elapsed / (1 + drift_)) + 1);
  }

 private:
  static constexpr std::chrono::nanoseconds kEpoch = std::chrono::hours(500'000);  // about 2027

  std::chrono::nanoseconds calc_elapsed() const {
    const auto now = timeline_.now().count();
    return std::chrono::nanoseconds(now +
                                    static_cast<std::int64_t>(static_cast<double>(now) * drift_));
  }

  const Timeline& timeline_;
  const std::string name_;
  const std::chrono::nanoseconds uptime_;
  const double drift_;
  std::chrono::nanoseconds wall_offset_;
  bool has_jumped_ = false;  // the wall clock
};

/// A process on a host: what it does happens only while it runs.
class Process {
 public:
  Process(Timeline& timeline, Host& host, std::string name)
      : timeline_(timeline), host_(host), name_(std::move(name)) {}

  Host& host() const { return host_; }
  const std::string& name() const { return name_; }
  bool is_server() const { return name_.rfind("server", 0) == 0; }
  bool has_ended() const { return has_ended_; }
  bool is_stopped() const { return is_stopped_; }

  /// Does `action` now; when it is continued, if it is stopped; never if it has ended.
  template <class Action>
  void run(Action&& action, bool is_timer = false) {
    if (has_ended_) return;
    if (is_stopped_)
      backlog_.push_back({std::forward<Action>(action), is_timer});
    else
      action();
  }
  /// The same at a time, as by a timer of its own.
  template <class Action>
  void run_at(Instant when, Action action) {
    timeline_.at(when,
                 [this, action = std::move(action)]() mutable { run(std::move(action), true); });
  }
  /// A datagram arrives: the socket of a stopped process keeps the first ones.
  bool has_room() const { return !is_stopped_ || backlog_.size() < kMostBacklog; }

  void stop() { is_stopped_ = true; }
  /// `are_timers_first`: its own threads run before those that receive.
  void go_on(bool are_timers_first = false) {
    is_stopped_ = false;
    if (are_timers_first)
      std::stable_partition(backlog_.begin(), backlog_.end(),
                            [](const Waiting& waiting) { return waiting.is_timer; });
    while (!backlog_.empty() && !is_stopped_ && !has_ended_) {
      const Timeline::Action action = std::move(backlog_.front().action);
      backlog_.pop_front();
      action();
    }
  }
  void end() { has_ended_ = true; }
  void kill() {
    was_killed_ = true;
    end();
  }
  bool was_killed() const { return was_killed_; }

 private:
  static constexpr std::size_t kMostBacklog = 400;

  struct Waiting {
    Timeline::Action action;
    bool is_timer = false;
  };

  Timeline& timeline_;
  Host& host_;
  const std::string name_;
  bool is_stopped_ = false;
  bool has_ended_ = false;
  bool was_killed_ = false;
  std::deque<Waiting> backlog_;
};

}  // namespace sls::worlds
