#include "common/sync/servers.hpp"

#include <algorithm>
#include <iterator>

#include "common/sync/room.hpp"

namespace sls::sync {
namespace {

using namespace std::chrono_literals;

/// The entry of run `run_id` in the last runs of a server.
template <class Known>
Known& find_or_add(std::deque<Known>& runs, std::uint64_t run_id) {
  for (Known& run : runs)
    if (run.run_id == run_id) return run;
  if (runs.size() == Servers::kMostRuns) runs.pop_front();
  runs.emplace_back().run_id = run_id;
  return runs.back();
}

}  // namespace

/// A run of a present server. Its samples are large, so they are copied only where they leave.
struct Servers::PresentRun {
  bus::PeerId server;
  const Parameters* parameters;
  const SimStatus* status;  // null before the claim is settled
  Time server_known_since;

  int progress() const { return status ? calc_progress(status->phase()) : 0; }
  Run copy() const {
    return {server, *parameters, status ? std::optional(*status) : std::nullopt,
            server_known_since};
  }
};

std::optional<Run> Servers::find_best(const std::vector<PresentRun>& runs,
                                      std::uint32_t vehicle_id) {
  const PresentRun* best = nullptr;
  for (const PresentRun& run : runs) {
    const int progress = run.progress();
    if (!run.status || progress < 0 || !serves_vehicle(*run.parameters, vehicle_id)) continue;
    if (!best || progress > best->progress() ||
        (progress == best->progress() && run.parameters->run_id() < best->parameters->run_id()))
      best = &run;
  }
  return best ? std::optional(best->copy()) : std::nullopt;
}

void Servers::note(const Parameters& sample, const bus::PeerId& sender, Time now) {
  Server* server = find_or_add_server(sender, true, now);
  if (!server) return;
  Claim& claim = find_or_add(server->claims, sample.run_id());
  if (claim.number == 0) claim.number = ++claims_;
  server->parameters = sample;
  report_impostors(sample.run_id());
}

bool Servers::note(const SimStatus& sample, const bus::PeerId& sender, Time now) {
  Server* server = find_or_add_server(sender, false, now);
  if (!server) return false;
  HeardStatus& heard = find_or_add(server->statuses, sample.run_id());
  heard.status = sample;
  heard.time = now;
  const auto owner = find_owner(sample.run_id());
  if (owner && !(*owner == sender)) report_impostors(sample.run_id());
  return !owner || *owner == sender;
}

/// Reports each server that has claimed run `run_id`, or has sent a status of it, although it
/// belongs to another.
void Servers::report_impostors(std::uint64_t run_id) {
  const auto owner = find_owner(run_id);
  const auto is_about_run = [run_id](const auto& item) { return item.run_id == run_id; };
  for (auto& [peer, server] : servers_) {
    if (peer == *owner || server.is_reported) continue;
    const bool has_claim = std::any_of(server.claims.begin(), server.claims.end(), is_about_run);
    const bool has_status =
        std::any_of(server.statuses.begin(), server.statuses.end(), is_about_run);
    if (!has_claim && !has_status) continue;
    server.is_reported = true;
    impostors_.push_back({peer, has_status ? "sls/status" : "sls/parameters", run_id, *owner});
  }
}

Servers::Unclaimed Servers::look_for_unclaimed(
    const std::map<bus::PeerId, std::set<std::string>>& writers, Time now) {
  // Discovery delivers the writers of a participant in the order in which they were made, and a
  // server makes that of sls/parameters first.
  constexpr auto kPatience = 1s;
  // On a lossy network the claim itself may need seconds.
  constexpr auto kPatienceWithWriter = 10s;
  Unclaimed unclaimed;
  for (auto it = unclaimed_since_.begin(); it != unclaimed_since_.end();)
    it = writers.count(it->first) > 0 ? std::next(it) : unclaimed_since_.erase(it);
  for (const auto& [peer, topics] : writers) {
    if (has_claimed(peer)) {
      if (unclaimed_since_.erase(peer) > 0) unclaimed.settled.push_back(peer);
      continue;
    }
    const Time since = unclaimed_since_.try_emplace(peer, now).first->second;
    const auto patience = present_.count(peer) > 0 ? kPatienceWithWriter : kPatience;
    if (now - since >= patience) unclaimed.found.emplace(peer, topics);
  }
  return unclaimed;
}

Servers::Server* Servers::find_or_add_server(const bus::PeerId& sender, bool claims, Time now) {
  // One that claims nothing displaces none that did: that may be a server that has just left.
  const auto is_kept = [&](const bus::PeerId& peer) {
    return peer == self_ || present_.count(peer) > 0 || (!claims && servers_.at(peer).parameters);
  };
  if (!make_room(servers_, kMostServers, sender, is_kept)) return nullptr;
  const auto [server, is_new] = servers_.try_emplace(sender);
  if (is_new) server->second.known_since = now;
  return &server->second;
}

std::optional<bus::PeerId> Servers::find_owner(std::uint64_t run_id) const {
  std::optional<bus::PeerId> owner;
  std::uint64_t first = 0;
  for (const auto& [server, known] : servers_)
    for (const Claim& claim : known.claims)
      if (claim.run_id == run_id && (!owner || claim.number < first)) {
        owner = server;
        first = claim.number;
      }
  return owner;
}

const Servers::HeardStatus* Servers::find_heard(std::uint64_t run_id) const {
  const auto owner = find_owner(run_id);
  if (!owner) return nullptr;
  for (const HeardStatus& heard : servers_.at(*owner).statuses)
    if (heard.run_id == run_id) return &heard;
  return nullptr;
}

bool Servers::is_present_run(const bus::PeerId& server, const Server& known, Time now) const {
  if (server == self_ || present_.count(server) == 0 || !known.parameters) return false;
  const std::uint64_t run_id = known.parameters->run_id();
  if (find_owner(run_id) != server) return false;
  const HeardStatus* heard = find_heard(run_id);
  return !heard || calc_progress(heard->status.phase()) <= 0 ||
         now - heard->time <= kPresumedDeadAfter;
}

std::vector<Servers::PresentRun> Servers::present_runs(Time now) const {
  std::vector<PresentRun> runs;
  for (const auto& [server, known] : servers_) {
    if (!is_present_run(server, known, now)) continue;
    const HeardStatus* heard = find_heard(known.parameters->run_id());
    runs.push_back(
        {server, &*known.parameters, heard ? &heard->status : nullptr, known.known_since});
  }
  return runs;
}

std::vector<Run> Servers::runs(Time now) const {
  const auto present = present_runs(now);
  std::vector<Run> runs;
  runs.reserve(present.size());
  for (const PresentRun& run : present) runs.push_back(run.copy());
  return runs;
}

bool Servers::is_known(std::uint64_t run_id, Time now) const {
  const auto owner = find_owner(run_id);
  if (!owner) return false;
  const Server& known = servers_.at(*owner);
  return known.parameters->run_id() == run_id && is_present_run(*owner, known, now);
}

bool Servers::may_fly(std::uint64_t run_id, std::uint32_t vehicle_id) const {
  const auto owner = find_owner(run_id);
  return !owner || serves_vehicle(*servers_.at(*owner).parameters, vehicle_id);
}

std::optional<Run> Servers::find_joinable(std::uint32_t vehicle_id, Time now) const {
  return find_best(present_runs(now), vehicle_id);
}

std::optional<Run> Servers::find_successor(const Run& run,
                                           const std::vector<std::uint32_t>& vehicle_ids,
                                           Time now) const {
  const std::uint64_t run_id = run.parameters.run_id();
  const auto heard = find_last_heard(run_id);
  const bool is_dead = is_silent(run_id, now);
  std::vector<PresentRun> successors;
  for (const PresentRun& other : present_runs(now)) {
    if (other.parameters->run_id() == run_id) continue;
    const bool is_own = other.server == run.server;
    const bool is_new = !heard || other.server_known_since > *heard;
    if (is_own || (is_dead && is_new)) successors.push_back(other);
  }
  for (const std::uint32_t id : vehicle_ids)
    if (auto best = find_best(successors, id)) return best;
  return std::nullopt;
}

const SimStatus* Servers::find_status(std::uint64_t run_id) const {
  const HeardStatus* heard = find_heard(run_id);
  return heard ? &heard->status : nullptr;
}

std::optional<Time> Servers::find_last_heard(std::uint64_t run_id) const {
  const HeardStatus* heard = find_heard(run_id);
  return heard ? std::optional(heard->time) : std::nullopt;
}

bool Servers::is_silent(std::uint64_t run_id, Time now) const {
  const auto heard = find_last_heard(run_id);
  return !heard || now - *heard > kPresumedDeadAfter;
}

bool Servers::has_claimed(const bus::PeerId& server) const {
  const auto known = servers_.find(server);
  return known != servers_.end() && known->second.parameters;
}

int calc_progress(RunPhase phase) {
  switch (phase) {
    case RunPhase::PHASE_WAITING:
      return 1;
    case RunPhase::PHASE_RUNNING:
    case RunPhase::PHASE_PAUSED:
      return 2;
    case RunPhase::PHASE_FINISHED:
    case RunPhase::PHASE_FAILED:
    case RunPhase::PHASE_RESET:
      break;
  }
  return -1;
}

int calc_progress(const std::optional<SimStatus>& status) {
  return status ? calc_progress(status->phase()) : 0;
}

bool serves_vehicle(const Parameters& parameters, std::uint32_t vehicle_id) {
  const auto& vehicles = parameters.vehicles();
  return std::any_of(vehicles.begin(), vehicles.end(), [vehicle_id](const auto& vehicle) {
    return vehicle.vehicle_id() == vehicle_id;
  });
}

std::vector<std::uint32_t> list_vehicle_ids(const Parameters& parameters) {
  std::vector<std::uint32_t> ids;
  for (const VehicleParameters& vehicle : parameters.vehicles())
    ids.push_back(vehicle.vehicle_id());
  return ids;
}

bool is_fleet(const Parameters& parameters) { return parameters.vehicles().size() > 1; }

}  // namespace sls::sync
