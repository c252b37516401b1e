#include "sim_server/state_stream.hpp"

#include <algorithm>

#include "common/bus/message_size.hpp"

namespace sls::sim {

void StateStream::set_step(std::uint64_t run_id, std::uint64_t step, std::int64_t sim_time_ns) {
  sample_.run_id(run_id);
  sample_.step(step);
  sample_.sim_time_ns(sim_time_ns);
}

void StateStream::write_where(const std::function<bool(std::size_t)>& is_wanted) {
  const std::size_t bytes = bus::calc_size(vehicles_.front());
  const std::size_t most =
      std::clamp<std::size_t>(max_bytes_ / bytes, 1, std::size_t{SAMPLE_VEHICLES});
  for (std::size_t first = 0; first < vehicles_.size(); first += most) {
    const std::size_t end = std::min(first + most, vehicles_.size());
    bool is_sample_wanted = false;
    for (std::size_t i = first; i < end; ++i) is_sample_wanted = is_sample_wanted || is_wanted(i);
    if (!is_sample_wanted) continue;
    sample_.vehicles().assign(vehicles_.begin() + static_cast<std::ptrdiff_t>(first),
                              vehicles_.begin() + static_cast<std::ptrdiff_t>(end));
    queue_ ? queue_->writer_.write(sample_) : writer_.write(sample_);
  }
}

StateStream::Queue::Queue(StateStream& stream, std::size_t samples)
    : stream_(stream), writer_(stream.writer_, samples) {
  stream.queue_ = this;
}

StateStream::Queue::~Queue() {
  if (stream_.queue_ == this) stream_.queue_ = nullptr;  // otherwise a newer queue is in use
}

}  // namespace sls::sim
