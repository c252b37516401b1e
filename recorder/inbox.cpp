#include "recorder/inbox.hpp"

#include <sys/resource.h>

#include <algorithm>
#include <chrono>
#include <thread>
#include <utility>

namespace sls::record {
namespace {

/// Of the open run, and of all others together: of 100 vehicles at 250 Hz 3 s.
constexpr std::size_t kMaxSamples = 262'144;

std::uint64_t find_run_id(const Inbox::Sample& sample) {
  return std::visit([](const auto& message) { return message.run_id(); }, sample);
}

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

Inbox::Inbox(bus::Node& node, std::function<bool(std::uint64_t)> may_be_opened)
    : may_be_opened_(std::move(may_be_opened)),
      state_reader_(node, bus::kRecorderReaderProfile,
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
      if (run_id == open_) {
        if (samples_.size() < kMaxSamples)
          samples_.push_back({*sample, sender});
        else
          ++refused_;
      } else if (closed_.count(run_id) == 0 && may_be_opened_(run_id)) {
        // What is pushed out, the recording names as missing.
        if (waiting_.size() == kMaxSamples) waiting_.pop_front();
        waiting_.push_back({*sample, sender});
      }
    }
  }
  rest_when_idle();
}

void Inbox::open(std::uint64_t run_id, const bus::PeerId& server) {
  const std::lock_guard lock(mutex_);
  if (open_ != 0) closed_.insert(open_);
  open_ = run_id;
  server_ = server;
  samples_.clear();
  refused_ = 0;
  for (Received& received : std::exchange(waiting_, {})) {
    const std::uint64_t run = find_run_id(received.sample);
    if (run == run_id)
      samples_.push_back(std::move(received));
    else if (may_be_opened_(run))
      waiting_.push_back(std::move(received));
  }
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
    all.swap(samples_);
  }
  all.erase(std::remove_if(all.begin(), all.end(),
                           [this](const Received& received) { return !belongs(received); }),
            all.end());
  return all;
}

std::uint64_t Inbox::refused() const {
  const std::lock_guard lock(mutex_);
  return refused_;
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
