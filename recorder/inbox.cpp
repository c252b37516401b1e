#include "recorder/inbox.hpp"

#include <utility>
#include <vector>

namespace sls::record {

Inbox::Inbox(bus::Node& node, std::function<bool(std::uint64_t)> may_be_opened)
    : arrivals_(std::move(may_be_opened)),
      record_reader_(node, bus::kRecordReaderProfile,
                     [this](RecordBatch& batch, const bus::PeerId& sender) {
                       put({batch.run_id(), sender, std::move(batch)});
                     }),
      status_reader_(node, bus::kLatchedReaderProfile,
                     [this](const SimStatus& status, const bus::PeerId& sender) {
                       put({status.run_id(), sender, status});
                     }) {}

void Inbox::put(Arrivals::Received received) {
  const std::lock_guard lock(mutex_);
  arrivals_.put(std::move(received));
}

void Inbox::open(std::uint64_t run_id, const bus::PeerId& server) {
  const std::lock_guard lock(mutex_);
  arrivals_.open(run_id, server);
}

bool Inbox::empty_into(Recording& recording) {
  std::vector<Arrivals::Sample> samples;
  {
    const std::lock_guard lock(mutex_);
    samples = arrivals_.take_all();
  }
  const auto now = app::awake_clock().now();
  for (const Arrivals::Sample& sample : samples)
    if (const auto* batch = std::get_if<RecordBatch>(&sample))
      recording.add(*batch, now);
    else
      recording.add(std::get<SimStatus>(sample));
  return !samples.empty();
}

std::uint64_t Inbox::refused() const {
  const std::lock_guard lock(mutex_);
  return arrivals_.refused();
}

bool Inbox::hears(const bus::PeerId& server) const {
  return record_reader_.matched().count(server) > 0 && status_reader_.matched().count(server) > 0;
}

}  // namespace sls::record
