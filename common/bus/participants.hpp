/// Participants of the domain: controllers and recorders (sls/participant) and servers
/// (sls/parameters, sls/status). The rules are those of common/sync; both directories receive on
/// the middleware's threads, ask the clock, and any thread may call them.
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "common/bus/node.hpp"
#include "common/sync/membership.hpp"
#include "common/sync/servers.hpp"

namespace sls::bus {

/// Names of the nodes of our programs: others recognise them before they hear an announcement.
inline constexpr const char* kServerNode = "sim_server";
inline constexpr const char* kClientNode = "control_client";
inline constexpr const char* kRecorderNode = "recorder";

/// sync::Membership of a domain.
class ParticipantDirectory {
 public:
  explicit ParticipantDirectory(Node& node);

  std::vector<sync::Member> find(ParticipantRole role, std::uint64_t run_id) const;
  std::vector<sync::Member> all() const;
  int count_done(ParticipantRole role, std::uint64_t run_id) const;
  std::uint64_t version() const { return version_.load(std::memory_order_acquire); }

  /// True if this node has discovered every participant on this machine and heard an announcement
  /// of each that it has discovered: of each writer of sls/participant, and of each node
  /// kClientNode or kRecorderNode.
  bool has_heard_everyone() const;

  /// Participants with a writer of sls/participant, also those without an announcement yet.
  std::set<PeerId> writers() const { return reader_.matched(); }

 private:
  void note(const Participant& sample, const PeerId& sender);
  /// Calls `use` with the members that are present now.
  template <class Use>
  auto ask(Use use) const;

  const Node& node_;
  mutable std::mutex mutex_;
  mutable sync::Membership members_;
  std::atomic<std::uint64_t> version_{0};
  Reader<Participant> reader_;
};

/// Announces a participant, and repeats the announcement: its silence then means that it is gone.
class Announcer {
 public:
  explicit Announcer(Node& node) : writer_(node) {}

  void announce(const Participant& message);
  /// Call it at least every 0.1 s. Does nothing before the first announcement.
  void repeat_if_due();

  bool wait_for_acknowledgments(std::chrono::milliseconds limit) {
    return writer_.wait_for_acknowledgments(limit);
  }
  /// True if announcements reach `peer`.
  bool reaches(const PeerId& peer) const { return writer_.matched().count(peer) > 0; }

 private:
  Writer<Participant> writer_;
  std::optional<Participant> last_;
  std::chrono::steady_clock::time_point time_;
};

/// sync::Servers of a domain.
class ServerDirectory {
 public:
  /// `on_status`, if given, is called with every status sample that is not ignored, on a thread of
  /// the middleware.
  explicit ServerDirectory(Node& node, std::function<void(const SimStatus&)> on_status = {});

  /// Calls `use` with the sync::Servers that are present now, under their lock.
  template <class Use>
  auto ask(Use use) const {
    const auto present = parameters_reader_.matched();
    const std::lock_guard lock(mutex_);
    servers_.set_present(present);
    return use(static_cast<const sync::Servers&>(servers_));
  }

  std::vector<sync::Run> runs() const;
  bool is_known(std::uint64_t run_id) const;
  bool may_fly(std::uint64_t run_id, std::uint32_t vehicle_id) const;
  std::optional<sync::Run> find_joinable(std::uint32_t vehicle_id) const;
  std::optional<sync::Run> find_successor(const sync::Run& run,
                                          const std::vector<std::uint32_t>& vehicle_ids) const;
  std::optional<SimStatus> find_status(std::uint64_t run_id) const;
  std::optional<sync::Time> find_last_heard(std::uint64_t run_id) const;

  /// True if this node has discovered every participant on this machine and heard the claim of
  /// every server that it has discovered: of each writer of sls/parameters and each node
  /// kServerNode.
  bool has_heard_every_claim() const;

  /// True until the server has left, or its lease has run out.
  bool is_present(const PeerId& server) const;

  /// Reports participants that write what only servers write, but have claimed no vehicle. Call it
  /// at least twice a second; it does nothing more often than ten times.
  void look_for_impostors();

  /// Reports that `sender` has sent a sample of `topic` about run `run_id`, which belongs to
  /// `owner`.
  void note_impostor(const PeerId& sender, const char* topic, std::uint64_t run_id,
                     const PeerId& owner) const;

 private:
  /// Passes a sample on, and reports the impostors that it shows.
  template <class Sample>
  bool note(const Sample& sample, const PeerId& sender);

  const Node& node_;
  const PeerId self_;
  const std::function<void(const SimStatus&)> on_status_;
  mutable std::mutex mutex_;  // guards the members below
  mutable sync::Servers servers_;
  sync::Time impostors_looked_for_;
  Reader<Parameters> parameters_reader_;
  Reader<SimStatus> status_reader_;
};

/// This machine's name, at most 64 bytes, for sls/participant.
std::string host_name();

}  // namespace sls::bus
