#include "common/bus/participants.hpp"

#include <spdlog/spdlog.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <thread>
#include <utility>

#include "common/app/stop_signal.hpp"
#include "common/config/yaml_node.hpp"

namespace sls::bus {
namespace {

using namespace std::chrono_literals;

constexpr auto kRepeatAfter = 400ms;  // with the time between two calls, less than 0.5 s
// A participant that repeats an announcement twice at such intervals goes on with it. One that
// repeats it in a burst, or for another reason, need not.
constexpr auto kLeastInterval = 100ms, kLongestInterval = 1000ms;
constexpr int kRepeats = 2;
constexpr std::size_t kAges = 4;  // announcements: one of them was hardly delayed

constexpr std::size_t kMaxSenders = 256;
constexpr std::size_t kMaxServers = 64;
constexpr std::size_t kMaxRunsOfServer = 4;  // the current one and those before resets

/// True if `known` has room for `sender`. Only if `known` is full, it calls `find_present` and
/// drops a participant that has left.
template <class Known, class FindPresent>
bool make_room(std::map<PeerId, Known>& known, std::size_t most, const PeerId& sender,
               FindPresent find_present) {
  if (known.count(sender) > 0 || known.size() < most) return true;
  const std::set<PeerId> present = find_present();
  const auto gone = std::find_if(known.begin(), known.end(),
                                 [&](const auto& item) { return present.count(item.first) == 0; });
  if (gone == known.end()) return false;
  known.erase(gone);
  return true;
}

/// The entry of run `run_id` in the last runs of a server.
template <class Known>
Known& find_or_add(std::deque<Known>& runs, std::uint64_t run_id) {
  for (Known& run : runs)
    if (run.run_id == run_id) return run;
  if (runs.size() == kMaxRunsOfServer) runs.pop_front();
  runs.emplace_back().run_id = run_id;
  return runs.back();
}

/// True if one of `recorders` has completed steps since `last_steps`; updates `last_steps`.
bool get_further(const std::vector<ParticipantDirectory::Entry>& recorders,
                 std::map<PeerId, std::int64_t>& last_steps) {
  bool is_any_further = false;
  for (const auto& entry : recorders) {
    const std::int64_t step = entry.announcement.last_complete_step();
    std::int64_t& last = last_steps.try_emplace(entry.peer, step).first->second;
    is_any_further = step > std::exchange(last, step) || is_any_further;
  }
  return is_any_further;
}

/// The run to join for `vehicle_id`: the one with the most progress, then with the lowest run_id.
std::optional<Run> find_best(const std::vector<Run>& runs, std::uint32_t vehicle_id) {
  std::optional<Run> best;
  for (const Run& run : runs) {
    const int progress = calc_progress(run.status);
    if (!run.status || progress < 0 || !serves_vehicle(run.parameters, vehicle_id)) continue;
    if (!best || progress > calc_progress(best->status) ||
        (progress == calc_progress(best->status) &&
         run.parameters.run_id() < best->parameters.run_id()))
      best = run;
  }
  return best;
}

}  // namespace

ParticipantDirectory::ParticipantDirectory(Node& node)
    : reader_(node, kLatchedReaderProfile,
              [this, &node](const Participant& sample, const PeerId& sender) {
                node.note_announced_name(sender, sample.name().to_string());
                note(sample, sender);
              }) {}

void ParticipantDirectory::note(const Participant& sample, const PeerId& sender) {
  const auto written = reader_.written();
  const std::chrono::nanoseconds age = std::chrono::system_clock::now() - written;
  const auto now = std::chrono::steady_clock::now();
  const std::lock_guard lock(mutex_);
  if (!make_room(last_, kMaxSenders, sender, [this] { return reader_.matched(); })) return;
  const auto [known, is_new] = last_.try_emplace(sender);
  Heard& heard = known->second;
  const bool is_same_run = heard.announcement.run_id() == sample.run_id();
  if (!is_same_run || !sample.ready()) heard.ready_since.reset();
  if (sample.ready() && !heard.ready_since) heard.ready_since = now;
  const auto interval = written - std::exchange(heard.written, written);
  heard.time = now;
  heard.ages.push_back(age);
  if (heard.ages.size() > kAges) heard.ages.pop_front();
  if (!is_new && heard.announcement == sample) {
    if (interval >= kLeastInterval)
      heard.repeats = interval <= kLongestInterval ? heard.repeats + 1 : 0;
    return;
  }
  heard.repeats = 0;
  heard.announcement = sample;
  version_.fetch_add(1, std::memory_order_release);
}

std::vector<ParticipantDirectory::Entry> ParticipantDirectory::find(ParticipantRole role,
                                                                    std::uint64_t run_id) const {
  std::vector<Entry> found = all();
  const auto is_other = [&](const Entry& entry) {
    return entry.announcement.role() != role || entry.announcement.run_id() != run_id;
  };
  found.erase(std::remove_if(found.begin(), found.end(), is_other), found.end());
  return found;
}

std::vector<ParticipantDirectory::Entry> ParticipantDirectory::all() const {
  const auto present = reader_.matched();
  const std::lock_guard lock(mutex_);
  std::vector<Entry> found;
  for (const auto& [peer, heard] : last_)
    if (present.count(peer) > 0)
      found.push_back({peer, heard.announcement, heard.time,
                       *std::min_element(heard.ages.begin(), heard.ages.end()),
                       heard.ready_since.value_or(heard.time), heard.repeats >= kRepeats});
  return found;
}

int ParticipantDirectory::count_done(ParticipantRole role, std::uint64_t run_id) const {
  const std::lock_guard lock(mutex_);
  return static_cast<int>(std::count_if(last_.begin(), last_.end(), [&](const auto& item) {
    const Participant& announcement = item.second.announcement;
    return announcement.role() == role && announcement.run_id() == run_id && announcement.done();
  }));
}

void Announcer::announce(const Participant& message) {
  last_ = message;
  time_ = std::chrono::steady_clock::now();
  writer_.write(message);
}

void Announcer::repeat_if_due() {
  if (last_ && std::chrono::steady_clock::now() - time_ >= kRepeatAfter)
    announce(Participant(*last_));
}

bool are_recorders_done(const std::vector<ParticipantDirectory::Entry>& recorders) {
  return std::all_of(recorders.begin(), recorders.end(),
                     [](const ParticipantDirectory::Entry& entry) {
                       return entry.announcement.done() || entry.is_silent();
                     });
}

void wait_for_recorders_to_end(const ParticipantDirectory& participants, std::uint64_t run_id,
                               int expected, const RecorderPatience& patience) {
  app::Wait wait(patience.without_news);
  const app::Wait longest(patience.longest);
  std::map<PeerId, std::int64_t> last_steps;
  while (!wait.is_over() && !longest.is_over()) {
    const auto recorders = participants.find(ParticipantRole::ROLE_RECORDER, run_id);
    if (get_further(recorders, last_steps) && app::stop_signal() == 0) wait.renew();
    const int missing = expected - participants.count_done(ParticipantRole::ROLE_RECORDER, run_id);
    if (are_recorders_done(recorders) && missing <= 0) return;
    if (wait.is_report_due()) {
      std::string names;
      for (const auto& entry : recorders)
        if (!entry.announcement.done())
          names += fmt::format(" '{}' on {}", entry.announcement.name().c_str(),
                               entry.announcement.host().c_str());
      spdlog::info("waiting for: recorder{} to finish ({:.0f} s left)",
                   names.empty() ? " (gone)" : names, wait.seconds_left());
    }
    std::this_thread::sleep_for(app::kShortPollTime);
  }
}

ServerDirectory::ServerDirectory(Node& node, std::function<void(const SimStatus&)> on_status)
    : node_(node),
      self_(node.id()),
      on_status_(std::move(on_status)),
      parameters_reader_(
          node, kLatchedReaderProfile,
          [this, &node](const Parameters& sample, const PeerId& sender) {
            if (sample.contract_sha256() == kContractSha256) return note(sample, sender);
            const std::string got = sample.contract_sha256().to_string();
            node.note_problem(
                sender, "parameters",
                fmt::format("sls/parameters contract_sha256: expected {}, got {}", kContractSha256,
                            got.empty() ? "none" : config::to_printable(got, 64)));
          }),
      status_reader_(node, kLatchedReaderProfile,
                     [this](const SimStatus& sample, const PeerId& sender) {
                       if (note(sample, sender) && on_status_) on_status_(sample);
                     }) {}

void ServerDirectory::note(const Parameters& sample, const PeerId& sender) {
  const std::lock_guard lock(mutex_);
  Server* server = find_or_add_server(sender);
  if (!server) return;
  Claim& claim = find_or_add(server->claims, sample.run_id());
  if (claim.number == 0) claim.number = ++claims_;
  server->parameters = sample;
  report_impostors(sample.run_id());
}

bool ServerDirectory::note(const SimStatus& sample, const PeerId& sender) {
  const std::lock_guard lock(mutex_);
  Server* server = find_or_add_server(sender);
  if (!server) return false;
  HeardStatus& heard = find_or_add(server->statuses, sample.run_id());
  heard.status = sample;
  heard.time = std::chrono::steady_clock::now();
  const auto owner = find_owner(sample.run_id());
  if (owner && !(*owner == sender)) report_impostors(sample.run_id());
  return !owner || *owner == sender;
}

/// Reports each server that has claimed run `run_id`, or has sent a status of it, although it
/// belongs to another.
void ServerDirectory::report_impostors(std::uint64_t run_id) {
  const auto owner = find_owner(run_id);
  const auto is_about_run = [run_id](const auto& item) { return item.run_id == run_id; };
  for (auto& [peer, server] : servers_) {
    if (peer == *owner || server.is_reported) continue;
    const bool has_claim = std::any_of(server.claims.begin(), server.claims.end(), is_about_run);
    const bool has_status =
        std::any_of(server.statuses.begin(), server.statuses.end(), is_about_run);
    if (!has_claim && !has_status) continue;
    server.is_reported = true;
    note_impostor(peer, has_status ? Topic<SimStatus>::kName : Topic<Parameters>::kName, run_id,
                  *owner);
  }
}

void ServerDirectory::note_impostor(const PeerId& sender, const char* topic, std::uint64_t run_id,
                                    const PeerId& owner) const {
  const std::string name = owner == self_ ? "this server" : node_.describe(owner);
  node_.note_problem(sender, "impostor",
                     fmt::format("{} run_id: expected that of a run of its own, got {:016x}, a run "
                                 "of {}; its samples are ignored",
                                 topic, run_id, name));
}

void ServerDirectory::look_for_impostors() {
  constexpr auto kInterval = std::chrono::milliseconds(100);
  // Discovery delivers the writers of a participant in the order in which they were made, and a
  // server makes that of sls/parameters first.
  constexpr auto kPatience = std::chrono::seconds(1);
  // On a lossy network the claim itself may need seconds.
  constexpr auto kPatienceWithWriter = std::chrono::seconds(10);
  const auto now = std::chrono::steady_clock::now();
  {
    const std::lock_guard lock(mutex_);
    if (now - impostors_looked_for_ < kInterval) return;
    impostors_looked_for_ = now;
  }
  const auto writers = node_.find_writers_of_servers();
  const auto claimants = parameters_reader_.matched();
  const auto misfits = node_.find_misfits();
  const std::lock_guard lock(mutex_);
  for (auto it = unclaimed_since_.begin(); it != unclaimed_since_.end();)
    it = writers.count(it->first) > 0 ? std::next(it) : unclaimed_since_.erase(it);
  for (const auto& [peer, topics] : writers) {
    const auto known = servers_.find(peer);
    if (known != servers_.end() && known->second.parameters) {
      if (unclaimed_since_.erase(peer) > 0) node_.end_problem(peer, "claim");
      continue;
    }
    const auto since = unclaimed_since_.try_emplace(peer, now).first->second;
    const auto patience = claimants.count(peer) > 0 ? kPatienceWithWriter : kPatience;
    if (misfits.count(peer) > 0 || now - since < patience) continue;
    std::string names;
    for (const std::string& topic : topics) names += (names.empty() ? "" : ", ") + topic;
    node_.note_problem(peer, "claim",
                       fmt::format("writes {}: expected a claim in sls/parameters, got none; its "
                                   "samples are ignored",
                                   names));
  }
}

ServerDirectory::Server* ServerDirectory::find_or_add_server(const PeerId& sender) {
  const auto find_present = [this] {
    auto present = parameters_reader_.matched();
    present.insert(self_);
    return present;
  };
  if (!make_room(servers_, kMaxServers, sender, find_present)) return nullptr;
  const auto [server, is_new] = servers_.try_emplace(sender);
  if (is_new) server->second.known_since = std::chrono::steady_clock::now();
  return &server->second;
}

std::optional<PeerId> ServerDirectory::find_owner(std::uint64_t run_id) const {
  std::optional<PeerId> owner;
  std::uint64_t first = 0;
  for (const auto& [server, known] : servers_)
    for (const Claim& claim : known.claims)
      if (claim.run_id == run_id && (!owner || claim.number < first)) {
        owner = server;
        first = claim.number;
      }
  return owner;
}

const ServerDirectory::HeardStatus* ServerDirectory::find_heard(std::uint64_t run_id) const {
  const auto owner = find_owner(run_id);
  if (!owner) return nullptr;
  for (const HeardStatus& heard : servers_.at(*owner).statuses)
    if (heard.run_id == run_id) return &heard;
  return nullptr;
}

bool ServerDirectory::is_present_run(const PeerId& server, const Server& known,
                                     const std::set<PeerId>& present) const {
  if (server == self_ || present.count(server) == 0 || !known.parameters) return false;
  const std::uint64_t run_id = known.parameters->run_id();
  if (find_owner(run_id) != server) return false;
  const HeardStatus* heard = find_heard(run_id);
  return !heard || calc_progress(heard->status.phase()) <= 0 ||
         std::chrono::steady_clock::now() - heard->time <= kPresumedDeadAfter;
}

std::vector<Run> ServerDirectory::runs() const {
  const auto present = parameters_reader_.matched();
  const std::lock_guard lock(mutex_);
  std::vector<Run> runs;
  for (const auto& [server, known] : servers_) {
    if (!is_present_run(server, known, present)) continue;
    const HeardStatus* heard = find_heard(known.parameters->run_id());
    runs.push_back({server, *known.parameters, heard ? std::optional(heard->status) : std::nullopt,
                    known.known_since});
  }
  return runs;
}

bool ServerDirectory::is_known(std::uint64_t run_id) const {
  const auto present = parameters_reader_.matched();
  const std::lock_guard lock(mutex_);
  const auto owner = find_owner(run_id);
  if (!owner) return false;
  const Server& known = servers_.at(*owner);
  return known.parameters && known.parameters->run_id() == run_id &&
         is_present_run(*owner, known, present);
}

bool ServerDirectory::may_fly(std::uint64_t run_id, std::uint32_t vehicle_id) const {
  const std::lock_guard lock(mutex_);
  const auto owner = find_owner(run_id);
  return !owner || serves_vehicle(*servers_.at(*owner).parameters, vehicle_id);
}

std::optional<Run> ServerDirectory::find_joinable(std::uint32_t vehicle_id) const {
  return find_best(runs(), vehicle_id);
}

std::optional<Run> ServerDirectory::find_successor(
    const Run& run, const std::vector<std::uint32_t>& vehicle_ids) const {
  const std::uint64_t run_id = run.parameters.run_id();
  const auto heard = find_last_heard(run_id);
  const bool is_dead = is_silent(run_id);
  std::vector<Run> successors;
  for (const Run& other : runs()) {
    if (other.parameters.run_id() == run_id) continue;
    const bool is_own = other.server == run.server;
    const bool is_new = !heard || other.server_known_since > *heard;
    if (is_own || (is_dead && is_new)) successors.push_back(other);
  }
  if (successors.empty()) return std::nullopt;
  for (const std::uint32_t id : vehicle_ids)
    if (auto best = find_best(successors, id)) return best;
  return std::nullopt;
}

std::optional<SimStatus> ServerDirectory::find_status(std::uint64_t run_id) const {
  const std::lock_guard lock(mutex_);
  const HeardStatus* heard = find_heard(run_id);
  return heard ? std::optional(heard->status) : std::nullopt;
}

bool ServerDirectory::has_heard_every_claim() const {
  if (!node_.has_discovered_this_machine()) return false;
  std::set<PeerId> servers = node_.find_named(kServerNode);
  servers.merge(parameters_reader_.matched());
  servers.erase(self_);
  const std::lock_guard lock(mutex_);
  return std::all_of(servers.begin(), servers.end(), [this](const PeerId& server) {
    const auto known = servers_.find(server);
    return known != servers_.end() && known->second.parameters;
  });
}

bool ServerDirectory::is_present(const PeerId& server) const {
  return parameters_reader_.matched().count(server) > 0;
}

bool ServerDirectory::is_silent(std::uint64_t run_id) const {
  const auto heard = find_last_heard(run_id);
  return !heard || std::chrono::steady_clock::now() - *heard > kPresumedDeadAfter;
}

std::optional<std::chrono::steady_clock::time_point> ServerDirectory::find_last_heard(
    std::uint64_t run_id) const {
  const std::lock_guard lock(mutex_);
  const HeardStatus* heard = find_heard(run_id);
  return heard ? std::optional(heard->time) : std::nullopt;
}

ServerWatch::ServerWatch(const ServerDirectory& servers, const Run& run, double deadline_s)
    : servers_(servers),
      run_id_(run.parameters.run_id()),
      deadline_s_(deadline_s),
      heard_(Clock::now()),
      looked_(heard_) {}

ServerWatch::Finding ServerWatch::look() {
  constexpr auto kQuietTime = std::chrono::seconds(1);
  constexpr auto kLongestLook = std::chrono::milliseconds(500);
  const auto now = Clock::now();
  if (now - looked_ > kLongestLook) heard_ += now - looked_;
  looked_ = now;
  heard_ = std::max(heard_, servers_.find_last_heard(run_id_).value_or(heard_));
  if (Clock::now() - heard_ < kQuietTime) {
    if (is_reported_) spdlog::info("the server of run {:016x} is back", run_id_);
    wait_.reset();
    is_reported_ = false;
    return Finding::kThere;
  }
  if (!wait_) wait_.emplace(deadline_s_, Clock::duration::zero());
  if (wait_->is_over()) return Finding::kLost;
  if (wait_->is_report_due()) {
    spdlog::warn("waiting for: {} ({:.0f} s left)", describe(), wait_->seconds_left());
    is_reported_ = true;
  }
  return Finding::kSilent;
}

std::string ServerWatch::describe() const {
  const double silence_s = std::chrono::duration<double>(Clock::now() - heard_).count();
  return fmt::format("server of run {:016x} (silent for {:.1f} s)", run_id_, silence_s);
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

bool flies_vehicle(const Participant& controller, std::uint32_t vehicle_id) {
  const auto& ids = controller.vehicle_ids();
  return std::find(ids.begin(), ids.end(), vehicle_id) != ids.end();
}

std::string host_name() {
  std::array<char, 65> name{};
  return gethostname(name.data(), name.size() - 1) == 0 ? name.data() : "unknown";
}

}  // namespace sls::bus
