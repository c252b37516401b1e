#include "sim_server/event_queue.hpp"

#include <algorithm>

namespace sls::sim {

void EventQueue::put(Event event) {
  {
    const std::lock_guard lock(mutex_);
    const std::size_t most =
        std::holds_alternative<CommandSample>(event) ? kMostCommands : kMostRequests;
    if (counts_[event.index()] == most) return;
    ++counts_[event.index()];
    events_.push_back(std::move(event));
    is_empty_ = false;
  }
  filled_.notify_one();
}

std::deque<EventQueue::Event> EventQueue::take_all() {
  const std::lock_guard lock(mutex_);
  std::fill(std::begin(counts_), std::end(counts_), 0);
  is_empty_ = true;
  return std::exchange(events_, {});
}

void EventQueue::clear_commands() {
  const std::lock_guard lock(mutex_);
  events_.erase(std::remove_if(events_.begin(), events_.end(),
                               [](const Event& event) {
                                 return std::holds_alternative<CommandSample>(event);
                               }),
                events_.end());
  counts_[0] = 0;
  is_empty_ = events_.empty();
}

bool EventQueue::wait(std::chrono::steady_clock::time_point deadline) {
  std::unique_lock lock(mutex_);
  const bool has_news =
      filled_.wait_until(lock, deadline, [this] { return !events_.empty() || is_interrupted_; });
  is_interrupted_ = false;
  return has_news;
}

void EventQueue::interrupt() {
  {
    const std::lock_guard lock(mutex_);
    is_interrupted_ = true;
  }
  filled_.notify_one();
}

}  // namespace sls::sim
