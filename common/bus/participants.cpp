#include "common/bus/participants.hpp"

#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <thread>

namespace sls::bus {

ParticipantDirectory::ParticipantDirectory(Node& node)
    : reader_(node, kLatchedReaderProfile, [this](const Participant& sample, const PeerId& sender) {
        const std::lock_guard lock(mutex_);
        last_[sender] = sample;
        version_.fetch_add(1, std::memory_order_release);
      }) {}

std::vector<ParticipantDirectory::Entry> ParticipantDirectory::find(ParticipantRole role,
                                                                    std::uint64_t run_id) const {
  const auto present = reader_.matched();
  const std::lock_guard lock(mutex_);
  std::vector<Entry> found;
  for (const auto& [peer, announcement] : last_)
    if (announcement.role() == role && announcement.run_id() == run_id && present.count(peer) > 0)
      found.push_back({peer, announcement});
  return found;
}

bool are_recorders_done(const std::vector<ParticipantDirectory::Entry>& recorders) {
  return std::all_of(
      recorders.begin(), recorders.end(),
      [](const ParticipantDirectory::Entry& entry) { return entry.announcement.done(); });
}

void wait_for_recorders_to_end(const ParticipantDirectory& participants, std::uint64_t run_id) {
  constexpr auto kLongest = std::chrono::seconds(10);
  constexpr auto kPollTime = std::chrono::milliseconds(20);
  const auto give_up = std::chrono::steady_clock::now() + kLongest;
  while (!are_recorders_done(participants.find(ROLE_RECORDER, run_id)) &&
         std::chrono::steady_clock::now() < give_up)
    std::this_thread::sleep_for(kPollTime);
}

ServerDirectory::ServerDirectory(Node& node, std::function<void(const SimStatus&)> on_status)
    : self_(node.id()),
      on_status_(std::move(on_status)),
      parameters_reader_(node, kLatchedReaderProfile,
                         [this](const Parameters& sample, const PeerId& sender) {
                           const std::lock_guard lock(mutex_);
                           parameters_[sender] = sample;
                         }),
      status_reader_(node, kLatchedReaderProfile, [this](const SimStatus& sample, const PeerId&) {
        {
          const std::lock_guard lock(mutex_);
          status_[sample.run_id()] = sample;
        }
        if (on_status_) on_status_(sample);
      }) {}

std::vector<Run> ServerDirectory::runs() const {
  const auto present = parameters_reader_.matched();
  const std::lock_guard lock(mutex_);
  std::vector<Run> runs;
  for (const auto& [server, parameters] : parameters_) {
    if (server == self_ || present.count(server) == 0) continue;
    const auto status = status_.find(parameters.run_id());
    runs.push_back({server, parameters,
                    status == status_.end() ? std::nullopt : std::optional(status->second)});
  }
  return runs;
}

std::optional<Run> ServerDirectory::find_joinable(std::uint32_t vehicle_id) const {
  std::optional<Run> best;
  for (const Run& run : runs()) {
    const int progress = calc_progress(run.status);
    if (!run.status || progress < 0 || !serves_vehicle(run.parameters, vehicle_id)) continue;
    if (!best || progress > calc_progress(best->status) ||
        (progress == calc_progress(best->status) &&
         run.parameters.run_id() < best->parameters.run_id()))
      best = run;
  }
  return best;
}

std::optional<SimStatus> ServerDirectory::find_status(std::uint64_t run_id) const {
  const std::lock_guard lock(mutex_);
  const auto status = status_.find(run_id);
  return status == status_.end() ? std::nullopt : std::optional(status->second);
}

bool ServerDirectory::is_present(const PeerId& server) const {
  return parameters_reader_.matched().count(server) > 0;
}

int calc_progress(const std::optional<SimStatus>& status) {
  if (!status) return 0;
  switch (status->phase()) {
    case PHASE_WAITING:
      return 1;
    case PHASE_RUNNING:
    case PHASE_PAUSED:
      return 2;
    case PHASE_FINISHED:
    case PHASE_FAILED:
      break;
  }
  return -1;
}

bool serves_vehicle(const Parameters& parameters, std::uint32_t vehicle_id) {
  const auto& ids = parameters.vehicle_ids();
  return std::find(ids.begin(), ids.end(), vehicle_id) != ids.end();
}

std::string host_name() {
  std::array<char, 65> name{};
  return gethostname(name.data(), name.size() - 1) == 0 ? name.data() : "unknown";
}

}  // namespace sls::bus
