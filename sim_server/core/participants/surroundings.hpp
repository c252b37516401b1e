#pragma once

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "common/sync/membership.hpp"
#include "common/sync/servers.hpp"

namespace sls::sim {

/// The participants and endpoints that the server has discovered at one moment.
struct Neighbourhood {
  sync::Time now;
  std::vector<sync::Member> participants;  ///< of any run
  std::set<std::uint64_t> other_runs;      ///< runs of other servers
  std::set<std::uint32_t> other_vehicles;  ///< vehicles of other servers
  /// On a network packets are lost, and discovery needs longer.
  bool is_on_network = false;
  bool is_flying = true;  ///< nobody need answer while a run waits or is paused
  /// Participants with a matched writer of sls/command, as text.
  std::map<bus::PeerId, std::string> command_writers;
  std::set<bus::PeerId> state_readers;  ///< participants with a matched reader of sls/state
  /// Participants whose commands carry a source timestamp in the future: how far ahead of our
  /// clock, s.
  std::map<bus::PeerId, double> stamps_ahead_s;
  /// Controllers whose writer offers no DEADLINE (bus::Node::find_missing_deadlines).
  std::map<bus::PeerId, std::string> missing_deadlines;
  /// Participants with another problem in discovery, which explains why no announcement comes.
  std::set<bus::PeerId> explained;

  /// Adds the runs of other servers with their vehicles.
  void add(const std::vector<sync::Run>& runs) {
    for (const sync::Run& run : runs) {
      other_runs.insert(run.parameters.run_id());
      for (const std::uint32_t id : sync::list_vehicle_ids(run.parameters))
        other_vehicles.insert(id);
    }
  }
  /// The participant that has announced itself as `peer`; else null.
  const sync::Member* find(const bus::PeerId& peer) const {
    for (const sync::Member& member : participants)
      if (member.peer == peer) return &member;
    return nullptr;
  }
};

/// Removes controllers that are not matched in both directions: our writer of sls/state knows the
/// participants `readers`, our reader of sls/command the participants `writers`. A client announces
/// that it is ready when it sees the server, which may be earlier.
inline void keep_matched(std::vector<sync::Member>& controllers,
                         const std::set<bus::PeerId>& readers,
                         const std::set<bus::PeerId>& writers) {
  const auto is_unknown = [&](const sync::Member& client) {
    return readers.count(client.peer) == 0 || writers.count(client.peer) == 0;
  };
  controllers.erase(std::remove_if(controllers.begin(), controllers.end(), is_unknown),
                    controllers.end());
}

/// The questions of a server's core to its shell when it looks around. No function blocks or calls
/// the core.
class Surroundings {
 public:
  virtual ~Surroundings() = default;

  /// Changes when a participant announces something new.
  virtual std::uint64_t members_version() const = 0;
  /// Those present; of controllers, those that are matched (keep_matched).
  virtual std::vector<sync::Member> find_members(ParticipantRole role,
                                                 std::uint64_t run_id) const = 0;
  /// The runs of the other servers.
  virtual std::vector<sync::Run> find_other_runs() const = 0;
  virtual bool is_known_elsewhere(std::uint64_t run_id) const = 0;

  /// As is_claim_settled expects them (claim.hpp).
  virtual bool stays_on_this_machine() const = 0;
  virtual bool has_heard_every_claim() const = 0;

  /// Changes when the middleware finds a mistake of a participant, or one ends.
  virtual std::uint64_t problems_version() const = 0;
  /// The participants and endpoints for ParticipantCheck; ParticipantWatch adds the rest.
  virtual Neighbourhood find_neighbours() = 0;
  /// Makes `found`, texts by key, the mistakes of this run. Returns all that hold, in words.
  virtual std::string replace_problems(const std::map<std::string, std::string>& found) = 0;
  /// The causes that may keep participants from being discovered, to be appended to a message; else
  /// empty.
  virtual std::string describe_isolation() const = 0;
  /// The flight of another server on this machine, to be appended likewise.
  virtual std::string describe_other_flight() const { return ""; }

  /// The queues on the way to the network.
  struct Queues {
    std::uint64_t written = 0;           ///< record entries so far
    std::uint64_t history_steps = 0;     ///< whose records are kept for late recorders
    std::uint64_t missed_deadlines = 0;  ///< of commands so far, real time only
  };
  virtual Queues queues() const = 0;
  /// LIFESPAN of commands; nothing in lockstep.
  virtual std::optional<std::chrono::nanoseconds> command_lifespan() const = 0;

  /// Why the run must end, such as "interrupted by SIGINT"; empty before a stop signal.
  virtual std::string stop_signal() const = 0;
};

}  // namespace sls::sim
