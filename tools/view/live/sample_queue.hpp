/// Passes samples from the middleware's threads to the server's thread.
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <mutex>
#include <vector>

#include "tools/view/live/feed.hpp"

namespace sls::view {

/// Bounded: beyond `most_bytes` the oldest samples of the loop's topics and of sls/record are
/// dropped. Latched samples are dropped only if they alone exceed the limit, as in a flood. Each
/// topic keeps its order. New samples are announced once before they are taken, and at most once a
/// period. All functions may be called from any thread.
class SampleQueue {
 public:
  using Clock = std::chrono::steady_clock;
  static constexpr auto kPeriod = std::chrono::microseconds(1'000'000 / 60);

  /// The least time between two announcements; kPeriod until it is set.
  void set_period(Clock::duration period);

  explicit SampleQueue(std::size_t most_bytes) : most_bytes_(most_bytes) {}

  /// If true, the caller must make the server's thread call `take_all`.
  bool put(Sample sample);
  /// All samples, the latched ones first, each group oldest first.
  std::vector<Sample> take_all();

  /// Waits until `deadline`, until `interrupt`, or until samples put within a period are due.
  /// Returns true only in the last case; the caller must then make the server's thread call
  /// `take_all`.
  bool wait_until_due(Clock::time_point deadline);
  void interrupt();

  std::uint64_t dropped() const;

 private:
  bool is_due(Clock::time_point now) const {
    return !is_announced_ && !is_empty() && now >= announced_ + period_;
  }
  bool is_empty() const { return latched_.empty() && others_.empty(); }
  void drop_oldest(std::deque<Sample>& queue);

  const std::size_t most_bytes_;
  mutable std::mutex mutex_;  // protects the members below
  std::condition_variable changed_;
  std::deque<Sample> latched_;
  std::deque<Sample> others_;
  std::size_t bytes_ = 0;  // of both queues
  std::uint64_t dropped_ = 0;
  bool is_announced_ = false;
  bool is_interrupted_ = false;
  Clock::time_point announced_{};
  Clock::duration period_ = kPeriod;
};

}  // namespace sls::view
