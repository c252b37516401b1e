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

/// The participants that one participant of ours has discovered, and what of their endpoints does
/// not fit ours: it begins and ends those `Problems`. Only topics that begin with "sls/" count.
///
/// The middleware says no more than that some endpoint did not fit. Upstream: none reported; the
/// standard's status of incompatible QoS names neither the other endpoint nor the values, and there
/// is none for another type or representation. To be deleted when there is.
class Neighbours {
 public:
  static constexpr std::size_t kMostParticipants = 1000;
  static constexpr std::size_t kMostEndpoints = 4000;

  /// Identifies an endpoint of a participant.
  using EntityId = std::array<std::uint8_t, 4>;

  explicit Neighbours(Problems& problems) : problems_(problems) {}

  /// Our own participant's endpoints are no neighbours.
  void set_self(const PeerId& self);

  void note_participant(const PeerId& peer, const std::string& name, const std::string& address);
  void drop_participant(const PeerId& peer);
  void note_endpoint(const PeerId& peer, const EntityId& id, const EndpointFacts& facts);
  void drop_endpoint(const PeerId& peer, const EntityId& id);

  /// An endpoint of our own begins and ends.
  void add_own(const EndpointFacts& facts);
  void drop_own(const EndpointFacts& facts);

  /// A sample of a writer could not be read as the type of `topic`, because of `defect`.
  void note_misfit(const PeerId& peer, const EntityId& writer, const std::string& topic,
                   const std::string& type, const std::string& defect);

  /// Something else that a participant does wrong until it leaves.
  void note_problem(const PeerId& peer, const std::string& key, const std::string& text);

  /// 'foo' (10.0.0.2): what the participant says of itself.
  std::string describe(const PeerId& peer) const;

  /// Participants that a problem of ours names.
  std::set<PeerId> find_misfits() const;

  /// Writers of sls/command that offer a longer DEADLINE than ours asks, or none, in words; by
  /// their participants. That is no mistake of those who fly for another server, in lockstep: the
  /// server judges, who knows whom they serve.
  std::map<PeerId, std::string> find_missing_deadlines() const;

 private:
  struct Participant {
    std::string description;
    bool is_of_contract_1 = false;
  };
  using Endpoint = std::pair<PeerId, EntityId>;

  void judge(const Endpoint& endpoint, const EndpointFacts& facts);
  std::string describe_held(const PeerId& peer) const;
  bool is_of_contract_1(const PeerId& peer) const;

  Problems& problems_;
  mutable std::mutex mutex_;
  PeerId self_;
  std::map<PeerId, Participant> participants_;
  std::map<Endpoint, EndpointFacts> endpoints_;
  std::map<Endpoint, std::string> missing_deadlines_;
  std::vector<EndpointFacts> own_;
};

}  // namespace sls::bus
