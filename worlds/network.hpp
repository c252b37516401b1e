/// The simulated middleware: what DDS allows, and what a network does to it. Discovery, matching
/// per endpoint, best-effort and reliable readers, histories, late joiners, leaving with and
/// without goodbye. docs/worlds.md says what is left out.
#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "common/bus/peer.hpp"
#include "common/bus/topics.hpp"
#include "worlds/host.hpp"
#include "worlds/random.hpp"

namespace sls::worlds {

using bus::kTopics;
using bus::TopicId;

/// The way from one host to another. Probabilities are per datagram.
struct Link {
  Instant delay{50'000};
  Instant jitter{20'000};
  double loss = 0;
  double reordering = 0;  ///< a datagram is late by up to `late_by`
  Instant late_by{0};
  bool is_cut = false;
  Instant mended{0};         ///< the end of its last cut
  double duplicates = 0;     ///< best-effort samples that are sent twice
  Instant packet_time{0};    ///< per datagram; 0: no limit
  Instant busy_until{0};     ///< of the queue before it
  Instant stalled_until{0};  ///< what is sent before arrives after this
};

/// Time that a link of `bandwidth_mbit` needs for a datagram. Every sample counts as a full one.
Instant calc_packet_time(double bandwidth_mbit);

class Network;

/// Policies of a reader; none: 0.
struct ReaderLimits {
  Instant deadline{0};  ///< each one without a sample is counted
  Instant lifespan{0};  ///< older samples are dropped
};

/// A participant of the domain, with its endpoints.
class Peer {
 public:
  struct Arrival {
    bus::PeerId sender;
    Host::Wall written;  ///< by the sender's clock
  };

  /// `number`: counts the peers of the network.
  Peer(Network& network, Process& process, const bus::PeerId& id, std::size_t number)
      : network_(network), process_(process), id_(id), number_(number) {}

  /// Of commands in real time, as config/qos/endpoints.xml.
  static constexpr ReaderLimits kRealtimeLimits{std::chrono::milliseconds(100),
                                                std::chrono::milliseconds(200)};

  const bus::PeerId& id() const { return id_; }
  Process& process() const { return process_; }

  template <class Message>
  void add_reader(std::function<void(const Message&, const Arrival&)> handler,
                  ReaderLimits limits = {}) {
    const auto topic = static_cast<std::size_t>(bus::Topic<Message>::kId);
    readers_[topic].handler = [handler = std::move(handler)](const void* message,
                                                             const Arrival& arrival) {
      handler(*static_cast<const Message*>(message), arrival);
    };
    readers_[topic].limits = limits;
    endpoints_.push_back({topic, false});
  }
  /// Without a deadline it does not match a reader that asks for one.
  template <class Message>
  void add_writer(bool offers_deadline = true) {
    endpoints_.push_back(
        {static_cast<std::size_t>(bus::Topic<Message>::kId), true, offers_deadline});
  }
  template <class Message>
  void write(Message message) {
    write(static_cast<std::size_t>(bus::Topic<Message>::kId),
          std::make_shared<const Message>(std::move(message)));
  }

  /// Peers with a writer of `topic` that our reader is matched with.
  const std::set<bus::PeerId>& matched_writers(TopicId topic) const {
    return writers_[static_cast<std::size_t>(topic)];
  }
  /// Peers with a reader of `topic` that our writer is matched with.
  const std::set<bus::PeerId>& matched_readers(TopicId topic) const {
    return reader_peers_[static_cast<std::size_t>(topic)];
  }
  /// Peers with a writer that lacks the deadline that our reader asks for.
  const std::set<bus::PeerId>& missing_deadlines() const { return missing_deadlines_; }
  /// The peers that it has discovered, and when; again after a lease.
  const std::map<bus::PeerId, Instant>& known() const { return known_; }
  /// True if a lease that is shorter than usual has ended here, of a living or a dead peer.
  bool has_short_memory() const { return has_short_memory_; }
  bool is_acknowledged(TopicId topic) const;
  /// Deadlines without a sample, from the first sample on.
  std::uint64_t missed_deadlines(TopicId topic);
  /// Switches LIFESPAN of `topic` off, or on again.
  void ignore_lifespan(TopicId topic, bool is_ignored) {
    readers_[static_cast<std::size_t>(topic)].ignores_lifespan = is_ignored;
  }
  /// Samples that the writer of `topic` keeps for late readers.
  std::size_t history_depth(TopicId topic) const;

 private:
  friend class Network;
  struct Endpoint {
    std::size_t topic;
    bool is_writer;
    bool offers_deadline = true;
  };
  struct Written {
    std::uint64_t number;
    std::shared_ptr<const void> message;
    Host::Wall time;
  };
  struct History {
    std::uint64_t next = 1;
    std::deque<Written> kept;
  };
  struct Reader {
    std::function<void(const void*, const Arrival&)> handler;
    ReaderLimits limits;
    bool ignores_lifespan = false;
    std::optional<sync::Time> awaited_since;  // the last sample, or the last missed deadline
    std::uint64_t missed_deadlines = 0;
  };
  void write(std::size_t topic, std::shared_ptr<const void> message);
  void count_deadlines(Reader& reader) const;
  /// A sample arrives at our reader.
  void take(std::size_t topic, const Written& sample, const bus::PeerId& sender);

  Network& network_;
  Process& process_;
  const bus::PeerId id_;
  const std::size_t number_;
  std::vector<Endpoint> endpoints_;  // in the order of their discovery
  std::array<Reader, kTopics> readers_;
  std::array<History, kTopics> histories_;
  std::array<std::set<bus::PeerId>, kTopics> writers_, reader_peers_;
  std::map<bus::PeerId, Instant> known_;
  std::set<bus::PeerId> missing_deadlines_;
  bool has_short_memory_ = false;
  std::map<bus::PeerId, Instant> heard_;  // the last announcement, where leases are short
};

class Network {
 public:
  Network(Timeline& timeline, Random random) : timeline_(timeline), random_(random) {}

  /// Batches of sls/record that a writer keeps.
  void set_record_history(std::size_t batches) { record_history_ = batches; }
  /// Before peers join. With one that is shorter than `kLease` the living are forgotten, too.
  void set_lease(Instant lease);

  Link& link(const Host& from, const Host& to) { return links_[{&from, &to}]; }
  /// Longest time between two announcements of a participant.
  static constexpr Instant kDiscoveryRepeat = std::chrono::milliseconds(500);
  /// A participant that was not heard for this time is forgotten.
  static constexpr Instant kLease = std::chrono::seconds(60);
  static constexpr Instant kHeartbeat = std::chrono::milliseconds(50);
  /// The queue before a link; what does not fit is lost.
  static constexpr Instant kQueue = std::chrono::milliseconds(50);

  Peer& join(Process& process);
  /// The endpoints of `peer` are complete: others may discover it.
  void announce(Peer& peer);
  /// The process of `peer` has ended, `with_goodbye` to the others or without.
  void leave(Peer& peer, bool with_goodbye);
  const std::vector<std::unique_ptr<Peer>>& peers() const { return peers_; }
  Peer* find(const bus::PeerId& id) const;
  /// Since when both know each other with no cut between them; nothing if they do not.
  std::optional<Instant> find_connected_since(const bus::PeerId& a, const bus::PeerId& b) const;
  /// True if `observed` has left, and its goodbye to `observer` was lost.
  bool has_missed_leave(const bus::PeerId& observer, const bus::PeerId& observed) const {
    return missed_leaves_.count({observer, observed}) > 0;
  }
  /// When the queue before a link was full for the last time; nothing if none was.
  std::optional<Instant> last_full() const { return last_full_; }

 private:
  friend class Peer;
  /// The way of the samples of a topic from a writer to a reader.
  struct Channel {
    bool writer_knows = false;
    bool reader_knows = false;
    std::uint64_t next = 1;       // sample to be sent
    std::uint64_t delivered = 0;  // last sample that arrived
    Instant busy_until{0};        // samples of a reliable channel arrive in order
    bool is_waiting = false;      // for a repair
    bool is_active() const { return writer_knows && reader_knows; }
  };

  Channel& channel(const Peer& writer, const Peer& reader, std::size_t topic) {
    return channels_[writer.number_][reader.number_][topic];
  }
  void discover(Peer& observer, Peer& observed);
  void match(Peer& observer, Peer& observed, const Peer::Endpoint& endpoint);
  void forget(Peer& observer, const Peer& observed, bool is_by_lease);
  void expire_leases();
  void sent(Peer& writer, std::size_t topic);
  void send_now(Peer& writer, Peer& reader, std::size_t topic, const Peer::Written& sample);
  void send_reliably(Peer& writer, Peer& reader, std::size_t topic);
  void deliver(Peer& writer, Peer& reader, std::size_t topic, const Peer::Written& sample);
  /// Draws whether a datagram is lost.
  bool is_lost(const Peer& from, const Peer& to);
  /// Of a datagram that is sent now.
  Instant draw_delay(const Peer& from, const Peer& to);

  Timeline& timeline_;
  Random random_;
  std::vector<std::unique_ptr<Peer>> peers_;
  std::map<std::pair<const Host*, const Host*>, Link> links_;
  std::set<std::pair<bus::PeerId, bus::PeerId>> missed_leaves_;      // observer, observed
  std::vector<std::vector<std::array<Channel, kTopics>>> channels_;  // of writer to reader
  std::optional<Instant> last_full_;
  std::uint64_t next_id_ = 1;
  std::size_t record_history_ = 5000;
  Instant lease_ = kLease;
};

}  // namespace sls::worlds
