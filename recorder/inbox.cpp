#include "recorder/inbox.hpp"

#include <algorithm>
#include <iterator>
#include <utility>

namespace sls::record {
namespace {

constexpr std::size_t kMaxSamples = 65536;  // of one run
constexpr std::size_t kMaxRuns = 4;         // another vehicle's may be on the domain too

}  // namespace

Inbox::Inbox(bus::Node& node)
    : state_reader_(node, bus::kRecorderReaderProfile,
                    [this](const VehicleState& sample, const bus::PeerId& sender) {
                      put(sample.run_id(), sample, sender);
                    }),
      command_reader_(node, bus::kRecorderReaderProfile,
                      [this](const ControlCommand& sample, const bus::PeerId& sender) {
                        put(sample.run_id(), sample, sender);
                      }),
      reference_reader_(node, bus::kRecorderReaderProfile,
                        [this](const Reference& sample, const bus::PeerId& sender) {
                          put(sample.run_id(), sample, sender);
                        }),
      status_reader_(node, bus::kLatchedReaderProfile,
                     [this](const SimStatus& sample, const bus::PeerId& sender) {
                       put(sample.run_id(), sample, sender);
                     }) {}

void Inbox::put(std::uint64_t run_id, Sample sample, const bus::PeerId& sender) {
  const std::lock_guard lock(mutex_);
  if (closed_.count(run_id) > 0) return;
  const auto known = runs_.find(run_id);
  if (known == runs_.end() && runs_.size() >= kMaxRuns)
    runs_.erase(runs_.begin()->first == open_ ? std::next(runs_.begin()) : runs_.begin());
  Run& run = runs_[run_id];
  if (run.samples.size() < kMaxSamples)
    run.samples.push_back({std::move(sample), sender});
  else
    ++run.refused;
}

void Inbox::open(std::uint64_t run_id, const bus::PeerId& server) {
  const std::lock_guard lock(mutex_);
  if (open_ != 0) closed_.insert(open_);
  runs_.erase(open_);
  open_ = run_id;
  server_ = server;
}

bool Inbox::belongs(const Received& received) const {
  const bool is_of_any_sender = std::holds_alternative<ControlCommand>(received.sample) ||
                                std::holds_alternative<Reference>(received.sample);
  return is_of_any_sender || received.sender == server_;
}

std::deque<Inbox::Received> Inbox::take_all() {
  std::deque<Received> all;
  {
    const std::lock_guard lock(mutex_);
    all.swap(runs_[open_].samples);
  }
  all.erase(std::remove_if(all.begin(), all.end(),
                           [this](const Received& received) { return !belongs(received); }),
            all.end());
  return all;
}

std::uint64_t Inbox::refused() const {
  const std::lock_guard lock(mutex_);
  const auto run = runs_.find(open_);
  return run == runs_.end() ? 0 : run->second.refused;
}

bool Inbox::hears_server(const bus::PeerId& server) const {
  return state_reader_.matched().count(server) > 0;
}

bool Inbox::hears_client(const bus::PeerId& client) const {
  return command_reader_.matched().count(client) > 0 &&
         reference_reader_.matched().count(client) > 0;
}

}  // namespace sls::record
