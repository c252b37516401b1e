#include "tools/view/live/sample_queue.hpp"

#include <algorithm>
#include <iterator>
#include <utility>

namespace sls::view {

void SampleQueue::set_period(Clock::duration period) {
  const std::lock_guard lock(mutex_);
  period_ = period;
}

bool SampleQueue::put(Sample sample) {
  const auto now = Clock::now();
  const std::lock_guard lock(mutex_);
  const bool was_empty = is_empty();
  bytes_ += sample.cdr->size();
  (is_latched(sample.topic) ? latched_ : others_).push_back(std::move(sample));
  while (bytes_ > most_bytes_) drop_oldest(others_.empty() ? latched_ : others_);
  if (is_due(now)) {
    is_announced_ = true;
    announced_ = now;
    return true;
  }
  if (was_empty && !is_announced_) changed_.notify_one();
  return false;
}

void SampleQueue::drop_oldest(std::deque<Sample>& queue) {
  bytes_ -= queue.front().cdr->size();
  queue.pop_front();
  ++dropped_;
}

std::vector<Sample> SampleQueue::take_all() {
  std::vector<Sample> samples;
  const std::lock_guard lock(mutex_);
  samples.reserve(latched_.size() + others_.size());
  for (std::deque<Sample>* queue : {&latched_, &others_}) {
    samples.insert(samples.end(), std::make_move_iterator(queue->begin()),
                   std::make_move_iterator(queue->end()));
    queue->clear();
  }
  bytes_ = 0;
  is_announced_ = false;
  return samples;
}

bool SampleQueue::wait_until_due(Clock::time_point deadline) {
  std::unique_lock lock(mutex_);
  for (;;) {
    const auto now = Clock::now();
    if (is_due(now)) {
      is_announced_ = true;
      announced_ = now;
      return true;
    }
    if (std::exchange(is_interrupted_, false) || now >= deadline) return false;
    const bool has_some = !is_empty() && !is_announced_;
    changed_.wait_until(lock, has_some ? std::min(deadline, announced_ + period_) : deadline);
  }
}

void SampleQueue::interrupt() {
  {
    const std::lock_guard lock(mutex_);
    is_interrupted_ = true;
  }
  changed_.notify_one();
}

std::uint64_t SampleQueue::dropped() const {
  const std::lock_guard lock(mutex_);
  return dropped_;
}

}  // namespace sls::view
