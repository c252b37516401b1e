/// Samples on their way from the middleware's threads to the server's.
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

/// Bounded: beyond `most_bytes` the oldest of the loop's topics and of sls/record are dropped;
/// latched ones only where they alone are as many, as in a flood. Each topic keeps its order. New
/// samples are announced once before they are taken, and at most once a period. Called from any
/// thread.
class SampleQueue {
 public:
  using Clock = std::chrono::steady_clock;
  static constexpr auto kPeriod = std::chrono::microseconds(1'000'000 / 60);

  /// The least time between two announcements; kPeriod until it is set.
  void set_period(Clock::duration period);

  explicit SampleQueue(std::size_t most_bytes) : most_bytes_(most_bytes) {}

  /// True if the caller is to have the server's thread take what there is.
  bool put(Sample sample);
  /// All there is, oldest first.
  std::vector<Sample> take_all();

  /// Waits until `deadline`, until `interrupt`, or until what was put inside of a period is due:
  /// true then, and the caller is to have it taken.
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
  mutable std::mutex mutex_;  // over what follows
  std::condition_variable changed_;
  std::deque<Sample> latched_;
  std::deque<Sample> others_;
  std::size_t bytes_ = 0;  // of both
  std::uint64_t dropped_ = 0;
  bool is_announced_ = false;
  bool is_interrupted_ = false;
  Clock::time_point announced_{};
  Clock::duration period_ = kPeriod;
};

}  // namespace sls::view
