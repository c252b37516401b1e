#include "recorder/inbox.hpp"

#include <sys/resource.h>

#include <algorithm>
#include <chrono>
#include <iterator>
#include <thread>
#include <utility>

namespace sls::record {
namespace {

constexpr std::size_t kMaxSamples = 262'144;  // of one run: of 100 vehicles at 250 Hz 3 s
constexpr std::size_t kMaxRuns = 4;           // another vehicle's may be on the domain too

/// How often the calling thread has waited for anything.
long count_waits() {
  rusage usage{};
  getrusage(RUSAGE_THREAD, &usage);
  return usage.ru_nvcsw;
}

/// Called at the end of a handler. A thread that had to wait for its sample is in no hurry: it
/// leaves the next ones where the middleware puts them and fetches them together a little later.
/// While it waits for none, whoever writes need not wake it, which is most of what a recorder costs
/// the control loop.
void rest_when_idle() {
  constexpr auto kRest = std::chrono::milliseconds(1);
  thread_local long waits = 0;
  if (count_waits() == waits) return;
  std::this_thread::sleep_for(kRest);
  waits = count_waits();
}

}  // namespace

Inbox::Inbox(bus::Node& node)
    : state_reader_(node, bus::kRecorderReaderProfile,
                    [this](const VehicleState& sample, const bus::PeerId& sender) {
                      put(&sample, 1, sender);
                    }),
      command_reader_(node, bus::kRecorderReaderProfile,
                      [this](const ControlCommand& sample, const bus::PeerId& sender) {
                        put(&sample, 1, sender);
                      }),
      reference_reader_(
          node, bus::kRecorderReaderProfile,
          [this](const Reference& sample, const bus::PeerId& sender) { put(&sample, 1, sender); }),
      fleet_state_reader_(node, bus::kFleetRecorderReaderProfile,
                          [this](const FleetState& sample, const bus::PeerId& sender) {
                            put(sample.vehicles().data(), sample.vehicles().size(), sender);
                          }),
      fleet_command_reader_(node, bus::kFleetRecorderReaderProfile,
                            [this](const FleetCommand& sample, const bus::PeerId& sender) {
                              put(sample.vehicles().data(), sample.vehicles().size(), sender);
                            }),
      fleet_reference_reader_(node, bus::kFleetRecorderReaderProfile,
                              [this](const FleetReference& sample, const bus::PeerId& sender) {
                                put(sample.vehicles().data(), sample.vehicles().size(), sender);
                              }),
      status_reader_(
          node, bus::kLatchedReaderProfile,
          [this](const SimStatus& sample, const bus::PeerId& sender) { put(&sample, 1, sender); }) {
}

template <class Vehicle>
void Inbox::put(const Vehicle* samples, std::size_t count, const bus::PeerId& sender) {
  {
    const std::lock_guard lock(mutex_);
    for (const Vehicle* sample = samples; sample != samples + count; ++sample) {
      const std::uint64_t run_id = sample->run_id();
      if (closed_.count(run_id) > 0) continue;
      const auto known = runs_.find(run_id);
      if (known == runs_.end() && runs_.size() >= kMaxRuns)
        runs_.erase(runs_.begin()->first == open_ ? std::next(runs_.begin()) : runs_.begin());
      Run& run = runs_[run_id];
      if (run.samples.size() < kMaxSamples)
        run.samples.push_back({*sample, sender});
      else
        ++run.refused;
    }
  }
  rest_when_idle();
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

bool Inbox::hears_server(const bus::PeerId& server, bool is_fleet) const {
  return (is_fleet ? fleet_state_reader_.matched() : state_reader_.matched()).count(server) > 0;
}

bool Inbox::hears_client(const bus::PeerId& client, bool is_fleet) const {
  return is_fleet ? fleet_command_reader_.matched().count(client) > 0 &&
                        fleet_reference_reader_.matched().count(client) > 0
                  : command_reader_.matched().count(client) > 0 &&
                        reference_reader_.matched().count(client) > 0;
}

}  // namespace sls::record
