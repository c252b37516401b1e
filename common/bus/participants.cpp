#include "common/bus/participants.hpp"

#include <spdlog/spdlog.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <type_traits>
#include <utility>

#include "common/app/stop_signal.hpp"
#include "common/app/wait.hpp"
#include "common/config/yaml_node.hpp"

namespace sls::bus {
namespace {

using namespace std::chrono_literals;

}  // namespace

ParticipantDirectory::ParticipantDirectory(Node& node)
    : node_(node),
      reader_(node, kLatchedReaderProfile,
              [this, &node](const Participant& sample, const PeerId& sender) {
                node.note_announced_name(sender, sample.name().to_string());
                note(sample, sender);
              }) {}

void ParticipantDirectory::note(const Participant& sample, const PeerId& sender) {
  const auto written = reader_.written();
  const sync::Membership::Arrival arrival{app::awake_clock().now(), written,
                                          std::chrono::system_clock::now() - written};
  const auto present = reader_.matched();
  const std::lock_guard lock(mutex_);
  members_.set_present(present);
  members_.note(sample, sender, arrival);
  version_.store(members_.version(), std::memory_order_release);
}

template <class Use>
auto ParticipantDirectory::ask(Use use) const {
  const auto present = reader_.matched();
  const std::lock_guard lock(mutex_);
  members_.set_present(present);
  return use(members_);
}

std::vector<sync::Member> ParticipantDirectory::find(ParticipantRole role,
                                                     std::uint64_t run_id) const {
  return ask([&](const sync::Membership& members) { return members.find(role, run_id); });
}

std::vector<sync::Member> ParticipantDirectory::all() const {
  return ask([](const sync::Membership& members) { return members.all(); });
}

bool ParticipantDirectory::has_heard_everyone() const {
  if (!node_.has_discovered_this_machine()) return false;
  std::set<PeerId> awaited = reader_.matched();
  awaited.merge(node_.find_named(kClientNode));
  awaited.merge(node_.find_named(kRecorderNode));
  for (const sync::Member& member : all()) awaited.erase(member.peer);
  return awaited.empty();
}

int ParticipantDirectory::count_done(ParticipantRole role, std::uint64_t run_id) const {
  return ask([&](const sync::Membership& members) { return members.count_done(role, run_id); });
}

void Announcer::announce(const Participant& message) {
  last_ = message;
  time_ = app::awake_clock().now();
  writer_.write(message);
}

void Announcer::repeat_if_due() {
  if (last_ && app::awake_clock().now() - time_ >= sync::kRepeatAfter)
    announce(Participant(*last_));
}

ServerDirectory::ServerDirectory(Node& node, std::function<void(const SimStatus&)> on_status)
    : node_(node),
      self_(node.id()),
      on_status_(std::move(on_status)),
      servers_(self_),
      parameters_reader_(
          node, kLatchedReaderProfile,
          [this, &node](const Parameters& sample, const PeerId& sender) {
            if (sample.contract_sha256() == kContractSha256) {
              note(sample, sender);
              return;
            }
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

template <class Sample>
bool ServerDirectory::note(const Sample& sample, const PeerId& sender) {
  const auto present = parameters_reader_.matched();
  const std::lock_guard lock(mutex_);
  servers_.set_present(present);
  bool is_taken = true;
  if constexpr (std::is_same_v<Sample, SimStatus>)
    is_taken = servers_.note(sample, sender, app::awake_clock().now());
  else
    servers_.note(sample, sender, app::awake_clock().now());
  for (const auto& impostor : servers_.take_impostors())
    note_impostor(impostor.sender, impostor.topic, impostor.run_id, impostor.owner);
  return is_taken;
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
  constexpr auto kInterval = 100ms;
  const auto now = app::awake_clock().now();
  {
    const std::lock_guard lock(mutex_);
    if (now - impostors_looked_for_ < kInterval) return;
    impostors_looked_for_ = now;
  }
  const auto writers = node_.find_writers_of_servers();
  const auto misfits = node_.find_misfits();
  const auto present = parameters_reader_.matched();
  const std::lock_guard lock(mutex_);
  servers_.set_present(present);
  const auto unclaimed = servers_.look_for_unclaimed(writers, now);
  for (const PeerId& peer : unclaimed.settled) node_.end_problem(peer, "claim");
  for (const auto& [peer, topics] : unclaimed.found) {
    if (misfits.count(peer) > 0) continue;
    std::string names;
    for (const std::string& topic : topics) names += (names.empty() ? "" : ", ") + topic;
    node_.note_problem(peer, "claim",
                       fmt::format("writes {}: expected a claim in sls/parameters, got none; its "
                                   "samples are ignored",
                                   names));
  }
}

std::vector<sync::Run> ServerDirectory::runs() const {
  return ask([](const sync::Servers& servers) { return servers.runs(app::awake_clock().now()); });
}

bool ServerDirectory::is_known(std::uint64_t run_id) const {
  return ask([&](const sync::Servers& servers) {
    return servers.is_known(run_id, app::awake_clock().now());
  });
}

bool ServerDirectory::may_fly(std::uint64_t run_id, std::uint32_t vehicle_id) const {
  const std::lock_guard lock(mutex_);
  return servers_.may_fly(run_id, vehicle_id);
}

std::optional<sync::Run> ServerDirectory::find_joinable(std::uint32_t vehicle_id) const {
  return ask([&](const sync::Servers& servers) {
    return servers.find_joinable(vehicle_id, app::awake_clock().now());
  });
}

std::optional<sync::Run> ServerDirectory::find_successor(
    const sync::Run& run, const std::vector<std::uint32_t>& vehicle_ids) const {
  return ask([&](const sync::Servers& servers) {
    return servers.find_successor(run, vehicle_ids, app::awake_clock().now());
  });
}

std::optional<SimStatus> ServerDirectory::find_status(std::uint64_t run_id) const {
  const std::lock_guard lock(mutex_);
  const SimStatus* status = servers_.find_status(run_id);
  return status ? std::optional(*status) : std::nullopt;
}

std::optional<sync::Time> ServerDirectory::find_last_heard(std::uint64_t run_id) const {
  const std::lock_guard lock(mutex_);
  return servers_.find_last_heard(run_id);
}

bool ServerDirectory::has_heard_every_claim() const {
  if (!node_.has_discovered_this_machine()) return false;
  std::set<PeerId> awaited = node_.find_named(kServerNode);
  awaited.merge(parameters_reader_.matched());
  awaited.erase(self_);
  const std::lock_guard lock(mutex_);
  return std::all_of(awaited.begin(), awaited.end(),
                     [this](const PeerId& server) { return servers_.has_claimed(server); });
}

bool ServerDirectory::is_present(const PeerId& server) const {
  return parameters_reader_.matched().count(server) > 0;
}

std::string host_name() {
  std::array<char, 65> name{};
  return gethostname(name.data(), name.size() - 1) == 0 ? name.data() : "unknown";
}

}  // namespace sls::bus
