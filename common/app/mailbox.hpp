#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <mutex>
#include <optional>
#include <utility>

namespace sls::app {

/// A bounded queue from the middleware's threads to the one thread that works. `put` never blocks:
/// it refuses and counts an item that does not fit, so no item is lost silently.
template <class T>
class Mailbox {
 public:
  explicit Mailbox(std::size_t capacity) : capacity_(capacity) {}

  /// False if the queue was full: `item` is lost and `refused()` counts it.
  bool put(T item) {
    {
      const std::lock_guard lock(mutex_);
      if (items_.size() >= capacity_) {
        ++refused_;
        return false;
      }
      items_.push_back(std::move(item));
    }
    filled_.notify_one();
    return true;
  }

  /// Ends the current `wait`, or the next one if no thread waits now.
  void interrupt() {
    {
      const std::lock_guard lock(mutex_);
      is_interrupted_ = true;
    }
    filled_.notify_one();
  }

  bool is_empty() const {
    const std::lock_guard lock(mutex_);
    return items_.empty();
  }

  /// The oldest item. Waits for one until `deadline`; nothing if none came.
  std::optional<T> take(std::chrono::steady_clock::time_point deadline) {
    std::unique_lock lock(mutex_);
    if (!filled_.wait_until(lock, deadline, [this] { return !items_.empty(); }))
      return std::nullopt;
    std::optional<T> item(std::move(items_.front()));
    items_.pop_front();
    return item;
  }

  /// Waits for an item or for `interrupt`; false if `deadline` passes first.
  bool wait(std::chrono::steady_clock::time_point deadline) {
    std::unique_lock lock(mutex_);
    const bool has_news =
        filled_.wait_until(lock, deadline, [this] { return !items_.empty() || is_interrupted_; });
    is_interrupted_ = false;
    return has_news;
  }

  /// All items, oldest first, without waiting. A thread that polls saves its writers one wake-up
  /// per item.
  std::deque<T> take_all() {
    const std::lock_guard lock(mutex_);
    return std::exchange(items_, {});
  }

  /// Items refused so far.
  std::uint64_t refused() const {
    const std::lock_guard lock(mutex_);
    return refused_;
  }

 private:
  const std::size_t capacity_;
  mutable std::mutex mutex_;
  std::condition_variable filled_;
  std::deque<T> items_;
  std::uint64_t refused_ = 0;
  bool is_interrupted_ = false;
};

}  // namespace sls::app
