#include "recorder/inbox.hpp"

#include <algorithm>
#include <chrono>
#include <utility>

namespace sls::record {
namespace {

/// Limit for the open run, and for all other runs together. It is larger than the lead of a server
/// over its recorder. With 100 vehicles at 250 Hz it is 10 s.
constexpr std::size_t kMaxEntries = 262'144;

/// An empty batch counts as one entry, because it also needs memory.
std::size_t count_entries(const Inbox::Sample& sample) {
  const auto* batch = std::get_if<RecordBatch>(&sample);
  return batch ? std::max<std::size_t>(batch->entries().size(), 1) : 1;
}

}  // namespace

Inbox::Inbox(bus::Node& node, std::function<bool(std::uint64_t)> may_be_opened)
    : may_be_opened_(std::move(may_be_opened)),
      record_reader_(node, bus::kRecordReaderProfile,
                     [this](RecordBatch& batch, const bus::PeerId& sender) {
                       put({batch.run_id(), sender, std::move(batch)});
                     }),
      status_reader_(node, bus::kLatchedReaderProfile,
                     [this](const SimStatus& status, const bus::PeerId& sender) {
                       put({status.run_id(), sender, status});
                     }) {}

void Inbox::put(Received received) {
  const std::lock_guard lock(mutex_);
  put_locked(std::move(received));
}

void Inbox::put_locked(Received received) {
  const std::size_t size = count_entries(received.sample);
  if (received.run_id == open_) {
    if (received.sender != server_) return;
    const bool has_room = size_ + size <= kMaxEntries;
    (has_room ? size_ : refused_) += size;
    if (has_room) samples_.push_back(std::move(received.sample));
  } else if (closed_.count(received.run_id) == 0 && may_be_opened_(received.run_id)) {
    waiting_size_ += size;
    waiting_.push_back(std::move(received));
    // The recording lists dropped samples as missing.
    for (; waiting_size_ > kMaxEntries; waiting_.pop_front())
      waiting_size_ -= count_entries(waiting_.front().sample);
  }
}

void Inbox::open(std::uint64_t run_id, const bus::PeerId& server) {
  const std::lock_guard lock(mutex_);
  if (open_ != 0) closed_.insert(open_);
  open_ = run_id;
  server_ = server;
  samples_.clear();
  size_ = waiting_size_ = refused_ = 0;
  for (Received& received : std::exchange(waiting_, {})) put_locked(std::move(received));
}

bool Inbox::empty_into(Recording& recording) {
  std::deque<Sample> samples;
  {
    const std::lock_guard lock(mutex_);
    size_ = 0;
    samples.swap(samples_);
  }
  const auto now = std::chrono::steady_clock::now();
  for (const Sample& sample : samples)
    if (const auto* batch = std::get_if<RecordBatch>(&sample))
      recording.add(*batch, now);
    else
      recording.add(std::get<SimStatus>(sample));
  return !samples.empty();
}

std::uint64_t Inbox::refused() const {
  const std::lock_guard lock(mutex_);
  return refused_;
}

bool Inbox::hears(const bus::PeerId& server) const {
  return record_reader_.matched().count(server) > 0 && status_reader_.matched().count(server) > 0;
}

}  // namespace sls::record
