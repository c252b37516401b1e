/// Servers of a domain, by their claims in sls/parameters and their samples of sls/status. No
/// network and no clock here.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "common/bus/peer.hpp"
#include "common/sync/membership.hpp"
#include "common/sync/time.hpp"
#include "sls.h"

namespace sls::sync {

/// A server's run as its samples describe it.
struct Run {
  bus::PeerId server;
  Parameters parameters;
  std::optional<SimStatus> status;  ///< nothing before the claim on its vehicles is settled
  Time server_known_since;
};

/// The last parameters and status of every server. At most 64 servers; a new one replaces one that
/// has left. A run belongs to the server that claimed it first; samples of others about this run
/// are ignored, and their authors are reported.
class Servers {
 public:
  static constexpr std::size_t kMostServers = 64;
  static constexpr std::size_t kMostRuns = 4;  ///< of a server: this one and those before resets

  /// `self`: this participant, which never meets itself.
  explicit Servers(const bus::PeerId& self) : self_(self) {}

  /// Sets the participants with a writer of sls/parameters. Others are not present.
  void set_present(const std::set<bus::PeerId>& present) {
    if (present != present_) present_ = present;  // asked at every look, and rarely new
  }
  const std::set<bus::PeerId>& present() const { return present_; }

  void note(const Parameters& sample, const bus::PeerId& sender, Time now);
  /// False if the sample is ignored.
  bool note(const SimStatus& sample, const bus::PeerId& sender, Time now);

  /// Runs of the present servers, without this participant's own. A server that is silent before
  /// its run has ended does not count as present.
  std::vector<Run> runs(Time now) const;

  /// True if `run_id` is among `runs()`.
  bool is_known(std::uint64_t run_id, Time now) const;

  /// False if the server of run `run_id` is known, even if it has left, and does not fly
  /// `vehicle_id`.
  bool may_fly(std::uint64_t run_id, std::uint32_t vehicle_id) const;

  /// The run to join for `vehicle_id`: present, settled, neither finished nor failed. Among several
  /// it is the one with the most progress (calc_progress), then with the lowest run_id.
  std::optional<Run> find_joinable(std::uint32_t vehicle_id, Time now) const;

  /// The run that follows `run`, for the first of `vehicle_ids` that has one: the next run of the
  /// same server after a reset or, if that server is silent, the run of a server that was
  /// discovered after the last status. A server discovered earlier had lost the vehicle to ours, so
  /// it is no replacement.
  std::optional<Run> find_successor(const Run& run, const std::vector<std::uint32_t>& vehicle_ids,
                                    Time now) const;

  /// The last status of run `run_id`, even if its server has left; null before the first. It is
  /// valid until the next sample.
  const SimStatus* find_status(std::uint64_t run_id) const;

  /// When the last status of run `run_id` came; nothing before the first.
  std::optional<Time> find_last_heard(std::uint64_t run_id) const;

  /// True if no status of run `run_id` came within kPresumedDeadAfter, or none ever.
  bool is_silent(std::uint64_t run_id, Time now) const;

  /// True if the participant has claimed vehicles.
  bool has_claimed(const bus::PeerId& server) const;

  /// A sample of `topic` about run `run_id` came from `sender`, but the run belongs to `owner`.
  struct Impostor {
    bus::PeerId sender;
    const char* topic;
    std::uint64_t run_id;
    bus::PeerId owner;
  };
  /// Those found since the last call, each server once.
  std::vector<Impostor> take_impostors() { return std::exchange(impostors_, {}); }

  /// Participants that write topics of servers without a claim.
  struct Unclaimed {
    std::map<bus::PeerId, std::set<std::string>> found;  ///< patience is over; with their topics
    std::vector<bus::PeerId> settled;                    ///< have claimed vehicles since
  };
  /// `writers`: participants that write what only servers write, with the topics.
  Unclaimed look_for_unclaimed(const std::map<bus::PeerId, std::set<std::string>>& writers,
                               Time now);

 private:
  struct Claim {
    std::uint64_t run_id = 0;
    std::uint64_t number = 0;  // counts the received claims
  };
  struct HeardStatus {
    std::uint64_t run_id = 0;
    SimStatus status;
    Time time;
  };
  // A late joiner may receive all samples of one topic before those of the other. So each topic has
  // its own list of last runs, and neither list displaces entries that the other one requires.
  struct Server {
    std::optional<Parameters> parameters;
    std::deque<Claim> claims;
    std::deque<HeardStatus> statuses;
    bool is_reported = false;  // as an impostor
    Time known_since;
  };

  struct PresentRun;
  std::vector<PresentRun> present_runs(Time now) const;
  /// The run to join for `vehicle_id`: the one with the most progress, then with the lowest run_id.
  static std::optional<Run> find_best(const std::vector<PresentRun>& runs,
                                      std::uint32_t vehicle_id);
  void report_impostors(std::uint64_t run_id);
  Server* find_or_add_server(const bus::PeerId& sender, bool claims, Time now);
  std::optional<bus::PeerId> find_owner(std::uint64_t run_id) const;
  const HeardStatus* find_heard(std::uint64_t run_id) const;
  bool is_present_run(const bus::PeerId& server, const Server& known, Time now) const;

  const bus::PeerId self_;
  std::map<bus::PeerId, Server> servers_;
  std::set<bus::PeerId> present_;
  std::map<bus::PeerId, Time> unclaimed_since_;
  std::vector<Impostor> impostors_;
  std::uint64_t claims_ = 0;
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

}  // namespace sls::sync
