/// Participants of the domain: controllers and recorders (sls/participant) and servers
/// (sls/parameters, sls/status). Both directories receive on the middleware's threads; any thread
/// may call them.
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "common/app/wait.hpp"
#include "common/bus/node.hpp"

namespace sls::bus {

/// Participants announce themselves at least every 0.5 s. One silent for this long is presumed dead
/// until its next announcement. (The middleware's lease is much longer: docs/networks.md.)
inline constexpr auto kPresumedDeadAfter = std::chrono::seconds(2);

/// The last announcement of every controller and recorder that is still present. At most 256
/// participants, because other programs must not fill the memory; a new one replaces one that has
/// left.
class ParticipantDirectory {
 public:
  explicit ParticipantDirectory(Node& node);

  struct Entry {
    PeerId peer;
    Participant announcement;
    std::chrono::steady_clock::time_point heard;  ///< time of arrival
    /// Smallest age of its last announcements on arrival, by the sender's clock and ours: the delay
    /// of the network and of discovery, and how far the sender's clock is behind.
    std::chrono::nanoseconds age{0};
    /// Time of the first announcement for this run with `ready`.
    std::chrono::steady_clock::time_point ready_since{};
    /// The sender repeats this announcement about every 0.5 s: then its silence means that it is
    /// gone. Clients of this contract need not repeat it.
    bool is_repeated = false;
    /// The server sets this, for it knows the answers too (sim_server/presence.hpp).
    bool is_gone = false;

    bool is_silent() const { return std::chrono::steady_clock::now() - heard > kPresumedDeadAfter; }
  };

  /// Present participants of `role` that serve run `run_id`.
  std::vector<Entry> find(ParticipantRole role, std::uint64_t run_id) const;

  /// Present participants of every role and run.
  std::vector<Entry> all() const;

  /// Participants with a writer of sls/participant, also those without an announcement yet.
  std::set<PeerId> writers() const { return reader_.matched(); }

  /// Number of participants of `role` that have announced `done` for run `run_id`, also of those
  /// that have left since.
  int count_done(ParticipantRole role, std::uint64_t run_id) const;

  /// Changes with every announcement that differs from the one before it. Poll for what else may
  /// happen: a participant leaves, falls silent, or is heard again.
  std::uint64_t version() const { return version_.load(std::memory_order_acquire); }

 private:
  void note(const Participant& sample, const PeerId& sender);

  mutable std::mutex mutex_;
  struct Heard {
    Participant announcement;
    std::chrono::steady_clock::time_point time;
    std::deque<std::chrono::nanoseconds> ages;  // of the last announcements
    std::optional<std::chrono::steady_clock::time_point> ready_since;
    std::chrono::system_clock::time_point written;  // by the sender's clock
    int repeats = 0;  // announcements without a change at about the usual interval, in a row
  };
  std::map<PeerId, Heard> last_;
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

 private:
  Writer<Participant> writer_;
  std::optional<Participant> last_;
  std::chrono::steady_clock::time_point time_;
};

/// True if each of `recorders` has announced `done` or is silent.
bool are_recorders_done(const std::vector<ParticipantDirectory::Entry>& recorders);

/// Longest waits for recorders, s.
struct RecorderPatience {
  double without_news = 10;  ///< without a new complete step, or after a stop signal
  double longest = 60;       ///< in total, because any program can announce steps
};

/// Waits until all present recorders of run `run_id`, and at least `expected`, are done: until then
/// the server must keep its writers. Logs the recorders that are missing.
void wait_for_recorders_to_end(const ParticipantDirectory& participants, std::uint64_t run_id,
                               int expected, const RecorderPatience& patience = {});

/// Name of a server's node: others recognise it before they hear its claim.
inline constexpr const char* kServerNode = "sim_server";

/// A server's run as its samples describe it.
struct Run {
  PeerId server;
  Parameters parameters;
  std::optional<SimStatus> status;  ///< nothing before the claim on its vehicles is settled
  std::chrono::steady_clock::time_point server_known_since;
};

/// The last parameters and status of every present server that uses this contract. At most 64
/// servers; a new one replaces one that has left. A run belongs to the server that claimed it
/// first; samples of others about this run are ignored, and their authors are reported.
class ServerDirectory {
 public:
  /// `on_status`, if given, is called with every status sample that is not ignored, on a thread of
  /// the middleware.
  explicit ServerDirectory(Node& node, std::function<void(const SimStatus&)> on_status = {});

  /// Runs of the present servers, without this node's own. A server that is silent before its run
  /// has ended does not count as present.
  std::vector<Run> runs() const;

  /// True if `run_id` is among `runs()`.
  bool is_known(std::uint64_t run_id) const;

  /// False if the server of run `run_id` is known, even if it has left, and does not fly
  /// `vehicle_id`.
  bool may_fly(std::uint64_t run_id, std::uint32_t vehicle_id) const;

  /// The run to join for `vehicle_id`: present, settled, neither finished nor failed. Among several
  /// it is the one with the most progress (calc_progress), then with the lowest run_id.
  std::optional<Run> find_joinable(std::uint32_t vehicle_id) const;

  /// The run that follows `run`, for the first of `vehicle_ids` that has one: the next run of the
  /// same server after a reset or, if that server is silent, the run of a server that was
  /// discovered after the last status. A server discovered earlier had lost the vehicle to ours, so
  /// it is no replacement.
  std::optional<Run> find_successor(const Run& run,
                                    const std::vector<std::uint32_t>& vehicle_ids) const;

  /// The last status of run `run_id`, even if its server has left.
  std::optional<SimStatus> find_status(std::uint64_t run_id) const;

  /// True if this node has discovered every participant on this machine and heard the claim of
  /// every server that it has discovered: of each writer of sls/parameters and each node
  /// kServerNode.
  bool has_heard_every_claim() const;

  /// True until the server has left, or its lease has run out.
  bool is_present(const PeerId& server) const;

  /// True if no status of run `run_id` came within kPresumedDeadAfter, or none ever.
  bool is_silent(std::uint64_t run_id) const;

  /// When the last status of run `run_id` came; nothing before the first.
  std::optional<std::chrono::steady_clock::time_point> find_last_heard(std::uint64_t run_id) const;

  /// Reports participants that write what only servers write, but have claimed no vehicle. Call it
  /// at least twice a second; it does nothing more often than ten times.
  void look_for_impostors();

  /// Reports that `sender` has sent a sample of `topic` about run `run_id`, which belongs to
  /// `owner`.
  void note_impostor(const PeerId& sender, const char* topic, std::uint64_t run_id,
                     const PeerId& owner) const;

 private:
  struct Claim {
    std::uint64_t run_id = 0;
    std::uint64_t number = 0;  // counts the received claims
  };
  struct HeardStatus {
    std::uint64_t run_id = 0;
    SimStatus status;
    std::chrono::steady_clock::time_point time;
  };
  // A late joiner may receive all samples of one topic before those of the other. So each topic has
  // its own list of last runs, and neither list displaces entries that the other one requires.
  struct Server {
    std::optional<Parameters> parameters;
    std::deque<Claim> claims;
    std::deque<HeardStatus> statuses;
    bool is_reported = false;  // as an impostor
    std::chrono::steady_clock::time_point known_since;
  };

  void note(const Parameters& sample, const PeerId& sender);
  /// False if the sample is ignored.
  bool note(const SimStatus& sample, const PeerId& sender);
  void report_impostors(std::uint64_t run_id);
  Server* find_or_add_server(const PeerId& sender);
  std::optional<PeerId> find_owner(std::uint64_t run_id) const;
  const HeardStatus* find_heard(std::uint64_t run_id) const;
  bool is_present_run(const PeerId& server, const Server& known,
                      const std::set<PeerId>& present) const;

  const Node& node_;
  const PeerId self_;
  const std::function<void(const SimStatus&)> on_status_;
  mutable std::mutex mutex_;  // guards the members below
  std::map<PeerId, Server> servers_;
  std::map<PeerId, std::chrono::steady_clock::time_point> unclaimed_since_;
  std::chrono::steady_clock::time_point impostors_looked_for_;
  std::uint64_t claims_ = 0;
  Reader<Parameters> parameters_reader_;
  Reader<SimStatus> status_reader_;
};

/// Watches the server of a run, which publishes a status at least every 0.5 s. Logs within 1 s and
/// then every 5 s that the server is silent, and when it is back.
class ServerWatch {
 public:
  using Clock = std::chrono::steady_clock;

  /// Watches `run` from now on; its server is lost after `deadline_s` of silence.
  ServerWatch(const ServerDirectory& servers, const Run& run, double deadline_s);

  enum class Finding { kThere, kSilent, kLost };
  /// Call it several times a second. A gap of more than 0.5 s between calls means that this process
  /// itself was stopped: the gap does not count as silence of the server.
  Finding look();

  /// For messages: "server of run … (silent for 3.1 s)".
  std::string describe() const;

 private:
  const ServerDirectory& servers_;
  const std::uint64_t run_id_;
  const double deadline_s_;
  Clock::time_point heard_;
  Clock::time_point looked_;
  std::optional<app::Wait> wait_;  // while it is silent
  bool is_reported_ = false;
};

/// Progress of a run in this phase: 1 waiting, 2 running or paused, −1 ended.
int calc_progress(RunPhase phase);
/// The same for a run; 0 if it has no status yet.
int calc_progress(const std::optional<SimStatus>& status);

/// True if `vehicle_id` is among `parameters`' vehicles.
bool serves_vehicle(const Parameters& parameters, std::uint32_t vehicle_id);

/// Ids of the vehicles in `parameters`, which the server claims.
std::vector<std::uint32_t> list_vehicle_ids(const Parameters& parameters);

/// True if the run of `parameters` has several vehicles.
bool is_fleet(const Parameters& parameters);

/// True if the announcement `controller` includes `vehicle_id`.
bool flies_vehicle(const Participant& controller, std::uint32_t vehicle_id);

/// This machine's name, at most 64 bytes, for sls/participant.
std::string host_name();

}  // namespace sls::bus
