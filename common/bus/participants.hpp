/// Participants of the domain: controllers and recorders (sls/participant) and servers
/// (sls/parameters, sls/status). Both classes listen on the middleware's threads and may be asked
/// from any thread.
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

/// The last announcement of every controller and recorder that is still there. Of 256 participants
/// at most, so that strangers cannot fill the memory: those that have left make room.
class ParticipantDirectory {
 public:
  explicit ParticipantDirectory(Node& node);

  struct Entry {
    PeerId peer;
    Participant announcement;
    std::chrono::steady_clock::time_point heard;  ///< when it came
    /// Age of the youngest announcement when it came, by its clock and ours: about 0 if they
    /// agree, positive where its clock is behind.
    std::chrono::nanoseconds age{0};
    /// When it first said it was ready.
    std::chrono::steady_clock::time_point ready_since{};

    bool is_silent() const { return std::chrono::steady_clock::now() - heard > kPresumedDeadAfter; }
  };

  /// Present participants of `role` that serve run `run_id`.
  std::vector<Entry> find(ParticipantRole role, std::uint64_t run_id) const;

  /// Present participants, whatever their role and run.
  std::vector<Entry> all() const;

  /// Participants with a writer of sls/participant, whether they have announced anything or not.
  std::set<PeerId> writers() const { return reader_.matched(); }

  /// Participants of `role` that have said they are done with run `run_id`, also those that have
  /// left since.
  int count_done(ParticipantRole role, std::uint64_t run_id) const;

  /// Changes with every announcement (not with departures: ask again from time to time).
  std::uint64_t version() const { return version_.load(std::memory_order_acquire); }

 private:
  void note(const Participant& sample, const PeerId& sender);

  mutable std::mutex mutex_;
  struct Heard {
    Participant announcement;
    std::chrono::steady_clock::time_point time;
    std::chrono::nanoseconds age = std::chrono::nanoseconds::max();
    std::optional<std::chrono::steady_clock::time_point> ready_since;
  };
  std::map<PeerId, Heard> last_;
  std::atomic<std::uint64_t> version_{0};
  Reader<Participant> reader_;
};

/// True when every one of `recorders` that is not silent says it is done.
bool are_recorders_done(const std::vector<ParticipantDirectory::Entry>& recorders);

/// How long recorders are waited for, s.
struct RecorderPatience {
  double without_news = 10;  ///< while none gets further, and after a stop signal
  double longest = 60;       ///< anybody can announce steps
};

/// Waits until the recorders of run `run_id` that are there, and `expected` at least, are done:
/// until then the server must keep its writers. Says for whom it waits.
void wait_for_recorders_to_end(const ParticipantDirectory& participants, std::uint64_t run_id,
                               int expected, const RecorderPatience& patience = {});

/// A server's run as its samples describe it.
struct Run {
  PeerId server;
  Parameters parameters;
  std::optional<SimStatus> status;  ///< nothing before the claim on its vehicles is settled
  std::chrono::steady_clock::time_point server_known_since;
};

/// The last parameters and status of every server that is still there and uses this contract, of
/// 64 at most: those that have left make room. A run is of the server that was the first to claim
/// it; what other servers say of it is ignored.
class ServerDirectory {
 public:
  /// `on_status`, where given, sees every status sample, on a thread of the middleware.
  explicit ServerDirectory(Node& node, std::function<void(const SimStatus&)> on_status = {});

  /// Runs of the servers present, other than this node's own. A server whose run goes on but that
  /// is silent is not present.
  std::vector<Run> runs() const;

  /// True if `run_id` is among `runs()`.
  bool is_known(std::uint64_t run_id) const;

  /// False if the server of run `run_id` is known, also one that has gone, and does not fly
  /// `vehicle_id`.
  bool may_fly(std::uint64_t run_id, std::uint32_t vehicle_id) const;

  /// The run to join for `vehicle_id`: present, settled, neither finished nor failed; among several
  /// the one that is furthest, then the lowest run_id.
  std::optional<Run> find_joinable(std::uint32_t vehicle_id) const;

  /// The run to go on with for the first of `vehicle_ids` that has one, where `run` does not: its
  /// own server's after a reset or, where that is silent, one of another server that was not known
  /// before it fell silent. A server known before that had
  /// lost the vehicle to ours and does not replace it.
  std::optional<Run> find_successor(const Run& run,
                                    const std::vector<std::uint32_t>& vehicle_ids) const;

  /// The last status of run `run_id`, also of a server that has gone.
  std::optional<SimStatus> find_status(std::uint64_t run_id) const;

  /// True until the server has left, or its lease has run out.
  bool is_present(const PeerId& server) const;

  /// True when nothing was heard of run `run_id` for so long that its server is presumed dead.
  bool is_silent(std::uint64_t run_id) const;

  /// When the last status of run `run_id` came; nothing before the first.
  std::optional<std::chrono::steady_clock::time_point> find_last_heard(std::uint64_t run_id) const;

 private:
  struct Claim {
    std::uint64_t run_id = 0;
    std::uint64_t number = 0;  // counts the claims heard
  };
  struct HeardStatus {
    std::uint64_t run_id = 0;
    SimStatus status;
    std::chrono::steady_clock::time_point time;
  };
  // The two topics overtake each other: a late joiner may hear all of one before the other. So each
  // keeps the last runs that it has told of, and neither pushes out what the other needs.
  struct Server {
    std::optional<Parameters> parameters;
    std::deque<Claim> claims;
    std::deque<HeardStatus> statuses;
    std::chrono::steady_clock::time_point known_since;
  };

  void note(const Parameters& sample, const PeerId& sender);
  void note(const SimStatus& sample, const PeerId& sender);
  Server* find_or_add_server(const PeerId& sender);
  std::optional<PeerId> find_owner(std::uint64_t run_id) const;
  const HeardStatus* find_heard(std::uint64_t run_id) const;
  bool is_present_run(const PeerId& server, const Server& known,
                      const std::set<PeerId>& present) const;

  const PeerId self_;
  const std::function<void(const SimStatus&)> on_status_;
  mutable std::mutex mutex_;  // over what follows
  std::map<PeerId, Server> servers_;
  std::uint64_t claims_ = 0;
  Reader<Parameters> parameters_reader_;
  Reader<SimStatus> status_reader_;
};

/// Patience with the server of a run, which publishes a status at least every 0.5 s: says within
/// 1 s and every 5 s that it is silent, and when it is back.
class ServerWatch {
 public:
  using Clock = std::chrono::steady_clock;

  /// Watches `run` from now on; gives its server up after `deadline_s` of silence.
  ServerWatch(const ServerDirectory& servers, const Run& run, double deadline_s);

  enum class Finding { kThere, kSilent, kLost };
  /// Call it several times a second: time without a look, in which this process was stopped itself,
  /// is not held against the server.
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

/// Position of a phase on the way waiting → running → finished/failed.
int calc_progress(RunPhase phase);
/// The same of a run that may not have a status yet (0).
int calc_progress(const std::optional<SimStatus>& status);

/// True if `vehicle_id` is among `parameters`' vehicles.
bool serves_vehicle(const Parameters& parameters, std::uint32_t vehicle_id);

/// The vehicles that it claims.
std::vector<std::uint32_t> list_vehicle_ids(const Parameters& parameters);

/// True if the run of `parameters` is of several vehicles.
bool is_fleet(const Parameters& parameters);

/// True if the controller that announced itself so flies `vehicle_id`.
bool flies_vehicle(const Participant& controller, std::uint32_t vehicle_id);

/// This machine's name, at most 64 bytes, for sls/participant.
std::string host_name();

}  // namespace sls::bus
