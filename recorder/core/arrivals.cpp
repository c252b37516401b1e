#include "recorder/core/arrivals.hpp"

#include <algorithm>
#include <utility>

namespace sls::record {
namespace {

/// An empty batch counts as one entry, because it also needs memory.
std::size_t count_entries(const Arrivals::Sample& sample) {
  const auto* batch = std::get_if<RecordBatch>(&sample);
  return batch ? std::max<std::size_t>(batch->entries().size(), 1) : 1;
}

}  // namespace

void Arrivals::put(Received received) {
  const std::size_t size = count_entries(received.sample);
  if (received.run_id == open_) {
    if (received.sender != server_) return;
    const bool has_room = size_ + size <= most_entries_;
    (has_room ? size_ : refused_) += size;
    if (has_room) samples_.push_back(std::move(received.sample));
  } else if (closed_.count(received.run_id) == 0 && may_be_opened_(received.run_id)) {
    waiting_size_ += size;
    waiting_.push_back(std::move(received));
    // The recording lists dropped samples as missing.
    for (; waiting_size_ > most_entries_; waiting_.pop_front())
      waiting_size_ -= count_entries(waiting_.front().sample);
  }
}

void Arrivals::open(std::uint64_t run_id, const bus::PeerId& server) {
  if (open_ != 0) closed_.insert(open_);
  open_ = run_id;
  server_ = server;
  samples_.clear();
  size_ = waiting_size_ = refused_ = 0;
  for (Received& received : std::exchange(waiting_, {})) put(std::move(received));
}

std::vector<Arrivals::Sample> Arrivals::take_all() {
  size_ = 0;
  return std::exchange(samples_, {});
}

}  // namespace sls::record
