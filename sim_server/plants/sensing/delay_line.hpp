/// Samples under way: samples that were sent and can still be received.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>
#include <utility>

namespace sls::sim {

template <class Sample>
class DelayLine {
 public:
  /// Sends `sample` at `step`, which must be larger than those before.
  void put(std::int64_t step, Sample sample) { sent_.push_back({step, std::move(sample)}); }

  /// The last sample sent at or before `step`, or the first one if all were sent later. Removes the
  /// samples before it, so `step` must not decrease from call to call.
  const Sample& take(std::int64_t step) {
    while (sent_.size() > 1 && sent_[1].step <= step) sent_.pop_front();
    return sent_.front().sample;
  }

  /// The step at which the sample after the last taken one was sent; nothing if there is none.
  std::optional<std::int64_t> find_next() const {
    return sent_.size() > 1 ? std::optional(sent_[1].step) : std::nullopt;
  }

  /// Number of samples kept.
  std::size_t size() const { return sent_.size(); }

 private:
  struct Sent {
    std::int64_t step;
    Sample sample;
  };
  std::deque<Sent> sent_;
};

}  // namespace sls::sim
