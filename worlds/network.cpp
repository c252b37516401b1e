#include "worlds/network.hpp"

#include <algorithm>
#include <cstring>

namespace sls::worlds {
namespace {

using namespace std::chrono_literals;

constexpr bool is_best_effort(std::size_t topic) {
  return topic == static_cast<std::size_t>(TopicId::kState) ||
         topic == static_cast<std::size_t>(TopicId::kCommand);
}

constexpr double kDatagramBits = 1'400 * 8;  // sls.max_datagram_bytes of the network profiles

}  // namespace

Instant calc_packet_time(double bandwidth_mbit) {
  return Instant(static_cast<std::int64_t>(kDatagramBits / bandwidth_mbit * 1e3));
}

// As config/qos/endpoints.xml.
std::size_t Peer::history_depth(TopicId topic) const {
  if (topic == TopicId::kRecord) return network_.record_history_;
  return is_best_effort(static_cast<std::size_t>(topic)) ? 64 : 150;
}

void Peer::write(std::size_t topic, std::shared_ptr<const void> message) {
  History& history = histories_[topic];
  history.kept.push_back({history.next++, std::move(message), process_.host().wall()});
  const std::size_t depth = is_best_effort(topic) ? 1 : history_depth(static_cast<TopicId>(topic));
  if (history.kept.size() > depth) history.kept.pop_front();
  network_.sent(*this, topic);
}

bool Peer::is_acknowledged(TopicId topic) const {
  const auto index = static_cast<std::size_t>(topic);
  const History& history = histories_[index];
  for (const bus::PeerId& id : reader_peers_[index]) {
    const Peer* reader = network_.find(id);
    if (!reader) return false;
    const Network::Channel& way = network_.channel(*this, *reader, index);
    if (!way.writer_knows || way.delivered + 1 < history.next) return false;
  }
  return true;
}

std::uint64_t Peer::missed_deadlines(TopicId topic) {
  Reader& reader = readers_[static_cast<std::size_t>(topic)];
  count_deadlines(reader);
  return reader.missed_deadlines;
}

void Peer::count_deadlines(Reader& reader) const {
  if (!reader.awaited_since || reader.limits.deadline == Instant(0)) return;
  const auto missed = (process_.host().now() - *reader.awaited_since) / reader.limits.deadline;
  *reader.awaited_since += missed * reader.limits.deadline;
  reader.missed_deadlines += static_cast<std::uint64_t>(missed);
}

void Peer::take(std::size_t topic, const Written& sample, const bus::PeerId& sender) {
  Reader& reader = readers_[topic];
  count_deadlines(reader);
  reader.awaited_since = process_.host().now();
  const bool expires = reader.limits.lifespan > Instant(0) && !reader.ignores_lifespan;
  if (expires && process_.host().wall() > sample.time + reader.limits.lifespan) return;
  reader.handler(sample.message.get(), {sender, sample.time});
}

// --- discovery -----------------------------------------------------------------------------------

Peer& Network::join(Process& process) {
  bus::PeerId id;
  // The order of the ids is not that in which the programs start.
  const std::uint64_t number = random_.next();
  std::memcpy(id.bytes.data(), &number, sizeof number);
  std::memcpy(id.bytes.data() + sizeof number, &next_id_, 4);
  ++next_id_;
  for (auto& readers : channels_) readers.emplace_back();
  channels_.emplace_back(channels_.size() + 1);
  return *peers_.emplace_back(std::make_unique<Peer>(*this, process, id, peers_.size()));
}

Peer* Network::find(const bus::PeerId& id) const {
  for (const auto& peer : peers_)
    if (peer->id() == id) return peer.get();
  return nullptr;
}

std::optional<Instant> Network::find_connected_since(const bus::PeerId& a,
                                                     const bus::PeerId& b) const {
  Instant since{0};
  for (const auto& [from, to] : {std::pair(find(a), find(b)), std::pair(find(b), find(a))}) {
    const auto known = from->known().find(to->id());
    const Link& link = links_.at({&from->process().host(), &to->process().host()});
    if (known == from->known().end() || link.is_cut || link.stalled_until > timeline_.now())
      return std::nullopt;
    since = std::max({since, known->second, link.mended, link.stalled_until});
  }
  return since;
}

void Network::announce(Peer& peer) {
  for (const auto& other : peers_) {
    if (&other->process() == &peer.process() || other->process().has_ended()) continue;
    timeline_.after(draw_delay(peer, *other),
                    [this, &peer, other = other.get()] { discover(*other, peer); });
    timeline_.after(draw_delay(*other, peer),
                    [this, &peer, other = other.get()] { discover(peer, *other); });
  }
}

/// The announcement of `observed` arrives at `observer`, or is lost; it is repeated.
void Network::discover(Peer& observer, Peer& observed) {
  if (observer.process().has_ended() || observed.process().has_ended()) return;
  if (observer.process().is_stopped() || observed.process().is_stopped() ||
      is_lost(observed, observer) || is_lost(observer, observed)) {
    timeline_.after(kDiscoveryRepeat + Instant(random_.integer(0, 20'000'000)),
                    [this, &observer, &observed] { discover(observer, observed); });
    return;
  }
  observer.known_.emplace(observed.id(), timeline_.now());
  Instant when_reader{0}, when_writer{0};  // they are announced apart, each in their order
  for (const Peer::Endpoint endpoint : observed.endpoints_) {
    Instant& when = endpoint.is_writer ? when_writer : when_reader;
    when += Instant(random_.integer(100'000, 3'000'000));
    if (is_lost(observed, observer)) when += kHeartbeat * random_.integer(1, 4);
    timeline_.after(when, [this, &observer, &observed, endpoint] {
      observer.process().run([this, &observer, &observed, endpoint] {
        if (observer.known_.count(observed.id()) > 0) match(observer, observed, endpoint);
      });
    });
  }
}

void Network::match(Peer& observer, Peer& observed, const Peer::Endpoint& endpoint) {
  const auto is_counterpart = [&](const Peer::Endpoint& ours) {
    return ours.topic == endpoint.topic && ours.is_writer != endpoint.is_writer;
  };
  if (std::none_of(observer.endpoints_.begin(), observer.endpoints_.end(), is_counterpart)) return;
  const bool asks = observer.readers_[endpoint.topic].limits.deadline > Instant(0);
  if (endpoint.is_writer && !endpoint.offers_deadline && asks) {
    observer.missing_deadlines_.insert(observed.id());
  } else if (endpoint.is_writer) {
    observer.writers_[endpoint.topic].insert(observed.id());
    channel(observed, observer, endpoint.topic).reader_knows = true;
    if (!is_best_effort(endpoint.topic)) send_reliably(observed, observer, endpoint.topic);
  } else {
    observer.reader_peers_[endpoint.topic].insert(observed.id());
    channel(observer, observed, endpoint.topic).writer_knows = true;
    if (!is_best_effort(endpoint.topic)) send_reliably(observer, observed, endpoint.topic);
  }
}

void Network::leave(Peer& peer, bool with_goodbye) {
  for (const auto& other : peers_) {
    if (&other->process() == &peer.process() || other->process().has_ended()) continue;
    const bool is_heard = with_goodbye && !is_lost(peer, *other);
    if (!is_heard) missed_leaves_.insert({other->id(), peer.id()});
    const Instant delay = is_heard ? draw_delay(peer, *other) : lease_;
    timeline_.after(delay, [this, &peer, is_heard, other = other.get()] {
      other->process().run([this, &peer, is_heard, other] { forget(*other, peer, !is_heard); });
    });
  }
}

void Network::forget(Peer& observer, const Peer& observed, bool is_by_lease) {
  if (is_by_lease && lease_ < kLease) observer.has_short_memory_ = true;
  observer.known_.erase(observed.id());
  observer.missing_deadlines_.erase(observed.id());
  for (std::size_t topic = 0; topic < kTopics; ++topic) {
    observer.writers_[topic].erase(observed.id());
    observer.reader_peers_[topic].erase(observed.id());
    Channel& out = channel(observer, observed, topic);
    Channel& in = channel(observed, observer, topic);
    out.writer_knows = in.reader_knows = false;
    // After another discovery what has not arrived is sent again, and nothing arrives twice.
    out.next = out.delivered + 1;
    in.next = in.delivered + 1;
  }
}

void Network::set_lease(Instant lease) {
  lease_ = lease;
  if (lease < kLease) timeline_.after(kDiscoveryRepeat, [this] { expire_leases(); });
}

/// Each running peer hears the announcements of the others, or forgets those whose lease is over,
/// until it discovers them again. Of one that was stopped itself, either comes first.
void Network::expire_leases() {
  for (const auto& observer : peers_)
    for (const auto& observed : peers_) {
      const auto known = observer->known_.find(observed->id());
      if (known == observer->known_.end() || observer->process().has_ended() ||
          observer->process().is_stopped() || observed->process().has_ended())
        continue;
      Instant& heard = observer->heard_.emplace(observed->id(), known->second).first->second;
      heard = std::max(heard, known->second);
      const bool is_over = timeline_.now() - heard > lease_;
      const bool is_heard =
          !observed->process().is_stopped() && !is_lost(*observed, *observer) &&
          link(observed->process().host(), observer->process().host()).stalled_until <=
              timeline_.now();
      if (is_over && (!is_heard || random_.chance(0.5))) {
        forget(*observer, *observed, true);
        timeline_.after(kDiscoveryRepeat,
                        [this, observer = observer.get(), observed = observed.get()] {
                          discover(*observer, *observed);
                        });
      } else if (is_heard) {
        heard = timeline_.now();
      }
    }
  timeline_.after(kDiscoveryRepeat, [this] { expire_leases(); });
}

// --- samples -------------------------------------------------------------------------------------

bool Network::is_lost(const Peer& from, const Peer& to) {
  const Link& way = link(from.process().host(), to.process().host());
  const bool is_full = way.busy_until - timeline_.now() > kQueue;
  if (is_full) last_full_ = timeline_.now();
  return way.is_cut || is_full || random_.chance(way.loss);
}

Instant Network::draw_delay(const Peer& from, const Peer& to) {
  Link& way = link(from.process().host(), to.process().host());
  Instant delay = way.delay + Instant(random_.integer(0, way.jitter.count()));
  if (way.packet_time.count() > 0) {
    way.busy_until = std::max(way.busy_until, timeline_.now()) + way.packet_time;
    delay += way.busy_until - timeline_.now();
  }
  delay += std::max(way.stalled_until - timeline_.now(), Instant(0));
  if (random_.chance(way.reordering)) delay += Instant(random_.integer(0, way.late_by.count()));
  return delay;
}

void Network::sent(Peer& writer, std::size_t topic) {
  for (const bus::PeerId& id : writer.reader_peers_[topic]) {
    Peer* reader = find(id);
    if (is_best_effort(topic))
      send_now(writer, *reader, topic, writer.histories_[topic].kept.back());
    else
      send_reliably(writer, *reader, topic);
  }
}

void Network::send_now(Peer& writer, Peer& reader, std::size_t topic, const Peer::Written& sample) {
  const Link& way = link(writer.process().host(), reader.process().host());
  const int copies = random_.chance(way.duplicates) ? 2 : 1;
  for (int i = 0; i < copies; ++i) {
    if (is_lost(writer, reader)) continue;
    timeline_.after(draw_delay(writer, reader), [this, &writer, &reader, topic, sample] {
      if (reader.process().has_room())
        reader.process().run(
            [this, &writer, &reader, topic, sample] { deliver(writer, reader, topic, sample); });
    });
  }
}

/// Sends what the reader lacks. A lost sample is sent again after the next heartbeat, and those
/// after it wait.
void Network::send_reliably(Peer& writer, Peer& reader, std::size_t topic) {
  Channel& way = channel(writer, reader, topic);
  const Peer::History& history = writer.histories_[topic];
  if (!way.is_active() || way.is_waiting || writer.process().has_ended()) return;
  while (way.next < history.next) {
    way.next = std::max(way.next, history.kept.front().number);
    if (writer.process().is_stopped() || is_lost(writer, reader)) {
      way.is_waiting = true;
      timeline_.after(kHeartbeat, [this, &writer, &reader, topic] {
        channel(writer, reader, topic).is_waiting = false;
        send_reliably(writer, reader, topic);
      });
      return;
    }
    const Peer::Written& sample = history.kept[way.next - history.kept.front().number];
    ++way.next;
    way.busy_until = std::max(way.busy_until, timeline_.now() + draw_delay(writer, reader));
    timeline_.at(way.busy_until, [this, &writer, &reader, topic, sample] {
      reader.process().run(
          [this, &writer, &reader, topic, sample] { deliver(writer, reader, topic, sample); });
    });
  }
}

void Network::deliver(Peer& writer, Peer& reader, std::size_t topic, const Peer::Written& sample) {
  Channel& way = channel(writer, reader, topic);
  // A reader drops what is not newer than the last sample of the writer.
  if (!way.is_active() || sample.number <= way.delivered) return;
  way.delivered = sample.number;
  reader.take(topic, sample, writer.id());
}

}  // namespace sls::worlds
