#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <mutex>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "common/bus/fastdds/endpoint_facts.hpp"
#include "common/bus/peer.hpp"
#include "common/bus/problems.hpp"

namespace sls::bus {

/// The participants that one participant of ours has discovered. Compares their endpoints with ours
/// and adds mismatches to `Problems` while they last. Only topics that begin with "sls/" count, and
/// those whose names resemble one of ours.
///
/// The middleware only reports that some endpoint did not match. Upstream: none reported. The
/// standard's status of incompatible QoS names neither the other endpoint nor the values, and no
/// status reports another type or representation. To be deleted when the statuses contain these.
class Neighbours {
 public:
  static constexpr std::size_t kMostParticipants = 1000;
  static constexpr std::size_t kMostEndpoints = 4000;

  /// Identifies an endpoint of a participant.
  using EntityId = std::array<std::uint8_t, 4>;

  explicit Neighbours(Problems& problems) : problems_(problems) {}

  /// Sets our own participant, whose endpoints are ignored.
  void set_self(const PeerId& self);

  /// `obstacle`, if not empty, is a mistake that shows once the participant has endpoints of ours.
  void note_participant(const PeerId& peer, const std::string& name, const std::string& address,
                        const std::string& obstacle = {});
  /// The participant calls itself `name` in sls/participant. From now on that is its name, also in
  /// mistakes that are already listed. An empty name changes nothing.
  void note_announced_name(const PeerId& peer, const std::string& name);
  void drop_participant(const PeerId& peer);
  void note_endpoint(const PeerId& peer, const EntityId& id, const EndpointFacts& facts);
  void drop_endpoint(const PeerId& peer, const EntityId& id);

  /// Adds and removes an endpoint of our own.
  void add_own(const EndpointFacts& facts);
  void drop_own(const EndpointFacts& facts);

  /// A sample of a writer could not be read as the type of `topic`, because of `defect`.
  void note_misfit(const PeerId& peer, const EntityId& writer, const std::string& topic,
                   const std::string& type, const std::string& defect);

  /// Adds another mistake of a participant, which lasts until `end_problem` or until the
  /// participant leaves.
  void note_problem(const PeerId& peer, const std::string& key, const std::string& text);
  void end_problem(const PeerId& peer, const std::string& key);

  /// 'foo' (10.0.0.2): name and address that the participant announces.
  std::string describe(const PeerId& peer) const;

  /// Participants for which `Problems` has an entry of this object.
  std::set<PeerId> find_misfits() const;

  /// Texts about the writers of sls/command that offer a longer DEADLINE than our reader requests,
  /// or none; by participant. This is no mistake of a client that serves another server in
  /// lockstep. The server decides, because it has the run that each client announces.
  std::map<PeerId, std::string> find_missing_deadlines() const;

  /// Participants with a writer of sls/state, sls/status or sls/record, which only servers have;
  /// with the names of these topics.
  std::map<PeerId, std::set<std::string>> find_writers_of_servers() const;

 private:
  struct Participant {
    std::string name;            // of the DDS participant
    std::string announced_name;  // in sls/participant
    std::string address;
    std::string obstacle;
    std::string description;
  };
  using Endpoint = std::pair<PeerId, EntityId>;

  void judge(const Endpoint& endpoint, const EndpointFacts& facts);
  void describe_anew(const PeerId& peer, Participant& participant);
  std::string describe_held(const PeerId& peer) const;

  Problems& problems_;
  mutable std::mutex mutex_;
  PeerId self_;
  std::map<PeerId, Participant> participants_;
  std::map<Endpoint, EndpointFacts> endpoints_;
  std::map<Endpoint, std::string> missing_deadlines_;
  std::vector<EndpointFacts> own_;
};

/// 'foo', or "a participant without a name".
std::string describe_name(const std::string& name);

}  // namespace sls::bus
