#pragma once

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <utility>
#include <vector>

namespace sls::worlds {

/// Time since the world's start. Programs cannot read it: they see the clocks of host.hpp.
using Instant = std::chrono::nanoseconds;

/// The events of a world in the order of their times. Events of the same time keep the order in
/// which they were added.
class Timeline {
 public:
  using Action = std::function<void()>;

  Instant now() const { return now_; }
  /// `when`: not before now.
  void at(Instant when, Action action) {
    std::size_t place = actions_.size();
    if (free_.empty()) {
      actions_.push_back(std::move(action));
    } else {
      place = free_.back();
      free_.pop_back();
      actions_[place] = std::move(action);
    }
    events_.push_back({std::max(when, now_), number_++, place});
    std::push_heap(events_.begin(), events_.end(), is_later);
  }
  void after(Instant delay, Action action) { at(now_ + delay, std::move(action)); }

  /// Carries out the next event; false if there is none before `end`.
  bool step(Instant end) {
    if (events_.empty() || events_.front().when >= end) return false;
    std::pop_heap(events_.begin(), events_.end(), is_later);
    const Event event = events_.back();
    events_.pop_back();
    now_ = event.when;
    const Action action = std::move(actions_[event.place]);  // it may add others
    free_.push_back(event.place);
    action();
    return true;
  }
  std::uint64_t count() const { return number_; }

 private:
  struct Event {
    Instant when;
    std::uint64_t number;
    std::size_t place;  // of its action: the heap moves events often
  };
  static bool is_later(const Event& a, const Event& b) {
    return a.when != b.when ? a.when > b.when : a.number > b.number;
  }

  Instant now_{0};
  std::uint64_t number_ = 0;
  std::vector<Event> events_;
  std::vector<Action> actions_;
  std::vector<std::size_t> free_;  // places in actions_
};

}  // namespace sls::worlds
