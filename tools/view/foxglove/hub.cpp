#include "tools/view/foxglove/hub.hpp"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <array>

#include "common/bus/contract_text.hpp"
#include "common/sync/servers.hpp"
#include "tools/view/foxglove/sample_stamp.hpp"

namespace sls::view::foxglove {

namespace {

constexpr auto kTimeSpacing = std::chrono::microseconds(16'667);
constexpr auto kDroppedSpacing = std::chrono::seconds(1);
constexpr std::size_t kMostEvents = 32;
constexpr const char* kNoFlight = "No flight on this domain. Start one: ./sls run";

/// Read while there is a client, because their samples give the time.
constexpr std::array kClockTopics = {TopicId::kRecord, TopicId::kStatus};

std::vector<std::uint32_t> list_vehicles(const Parameters& parameters) {
  const auto ids = sync::list_vehicle_ids(parameters);
  const std::set<std::uint32_t> unique(ids.begin(), ids.end());
  return {unique.begin(), unique.end()};
}

}  // namespace

Hub::Hub(Feed& feed, Operator& requests, Clock clock)
    : feed_(feed), requests_(requests), clock_(std::move(clock)) {
  add_native_channels();
}

// --- clients -------------------------------------------------------------------------------------

void Hub::add(Client& client) {
  if (clients_.empty()) {
    feed_.add(*this);
    for (const TopicId topic : kClockTopics) feed_.want(topic);
  }
  clients_[&client].dropped = client.connection().dropped();
  greet(client);
}

void Hub::greet(Client& client) {
  const auto send = [&client](Payload text) {
    client.connection().send(MessageKind::kText, std::move(text), Delivery::kAlways);
  };
  send(make_server_info(session_id(), client.may_call()));
  if (!advertisement_) {
    std::vector<const Channel*> all;
    for (const auto& [id, open] : channels_) all.push_back(&open.channel);
    advertisement_ = make_advertise(all);
  }
  send(advertisement_);
  if (!run_id_) send(make_status(StatusLevel::kInfo, kNoFlight));
  for (const Payload& event : events_) send(event);
}

void Hub::remove(Client& client) {
  for (auto& [id, open] : channels_) {
    auto& subscribers = open.subscribers;
    const auto end = std::remove_if(
        subscribers.begin(), subscribers.end(),
        [&client](const Subscriber& subscriber) { return subscriber.client == &client; });
    if (end == subscribers.end()) continue;
    subscribers.erase(end, subscribers.end());
    if (subscribers.empty()) note_wanted(open, false);
  }
  clients_.erase(&client);
  if (!clients_.empty()) return;
  for (const TopicId topic : kClockTopics) feed_.unwant(topic);
  feed_.remove(*this);
  events_.clear();  // the source sends them again to a new listener
}

std::optional<std::string> Hub::subscribe(Client& client, const Subscribe::Item& item) {
  const auto found = channels_.find(item.channel_id);
  if (found == channels_.end())
    return fmt::format("subscribe: there is no channel {}", item.channel_id);
  for (const auto& [id, open] : channels_)
    for (const Subscriber& other : open.subscribers)
      if (other.client == &client && other.subscription_id == item.subscription_id)
        return fmt::format("subscribe: subscription {} is in use", item.subscription_id);
  OpenChannel& open = found->second;
  for (const Subscriber& other : open.subscribers)
    if (other.client == &client)
      return fmt::format("subscribe: channel {} is subscribed to already", item.channel_id);
  open.subscribers.push_back({&client, item.subscription_id});
  if (open.subscribers.size() == 1) note_wanted(open, true);
  if (has_time_)
    client.connection().send(MessageKind::kBinary, make_time(now_ns_), Delivery::kAlways);
  send_kept(open, open.subscribers.back());
  return std::nullopt;
}

bool Hub::unsubscribe(Client& client, std::uint32_t subscription_id) {
  for (auto& [id, open] : channels_)
    for (auto it = open.subscribers.begin(); it != open.subscribers.end(); ++it)
      if (it->client == &client && it->subscription_id == subscription_id) {
        open.subscribers.erase(it);
        if (open.subscribers.empty()) note_wanted(open, false);
        return true;
      }
  return false;
}

void Hub::note_wanted(const OpenChannel& channel, bool is_wanted) {
  if (channel.topic)
    is_wanted ? feed_.want(*channel.topic) : feed_.unwant(*channel.topic);
  else
    is_wanted ? ++subscribed_mirrors_ : --subscribed_mirrors_;
}

void Hub::send_kept(const OpenChannel& channel, const Subscriber& subscriber) {
  const auto send = [&subscriber](std::int64_t time_ns, const std::vector<std::uint8_t>& cdr) {
    subscriber.client->connection().send(
        MessageKind::kBinary, make_message_data(subscriber.subscription_id, time_ns, cdr),
        Delivery::kAlways);
  };
  for (const Kept& kept : channel.kept) send(kept.time_ns, kept.cdr);
  if (!channel.topic || !is_latched(*channel.topic)) return;
  for (const Sample& sample : feed_.latched(*channel.topic)) send(find_time(sample), *sample.cdr);
}

// --- channels ------------------------------------------------------------------------------------

Hub::OpenChannel& Hub::open_channel(Channel channel) {
  channel.id = next_channel_id_++;
  OpenChannel& open = channels_[channel.id];
  open.channel = std::move(channel);
  advertisement_.reset();
  return open;
}

void Hub::add_native_channels() {
  for (std::size_t i = 0; i < kTopics; ++i) {
    const auto topic = static_cast<TopicId>(i);
    OpenChannel& open = open_channel(
        {0, name_of(topic), type_of(topic), "omgidl", std::string(bus::kContractText)});
    open.topic = topic;
    natives_.push_back(&open);
  }
}

std::vector<std::uint32_t> Hub::close_vanished_mirrors(const std::vector<ros::Channel>& wanted) {
  std::set<std::string> topics;
  for (const ros::Channel& channel : wanted) topics.insert(channel.topic);
  std::vector<std::uint32_t> closed;
  for (OpenChannel* mirror : mirrors_) {
    mirror->kept.clear();
    if (topics.count(mirror->channel.topic) > 0) continue;
    close_subscriptions(*mirror);
    closed.push_back(mirror->channel.id);
  }
  for (const std::uint32_t id : closed) channels_.erase(id);
  mirrors_.clear();
  advertisement_.reset();
  return closed;
}

void Hub::close_subscriptions(OpenChannel& channel) {
  for (const Subscriber& subscriber : channel.subscribers)
    subscriber.client->forget(subscriber.subscription_id);
  if (!channel.subscribers.empty()) note_wanted(channel, false);
  channel.subscribers.clear();
}

/// Opens channels for new mirrors. Mirrors of vehicles that the old run had, too, keep their
/// channels.
std::vector<const Channel*> Hub::open_mirrors(const std::vector<ros::Channel>& wanted) {
  std::map<std::string, OpenChannel*> there;
  for (auto& [id, open] : channels_)
    if (!open.topic) there[open.channel.topic] = &open;
  std::vector<const Channel*> opened;
  for (const ros::Channel& mirror : wanted) {
    OpenChannel*& open = there[mirror.topic];
    if (!open) {
      open = &open_channel({0, mirror.topic, mirror.type, "ros2msg", mirror.schema});
      opened.push_back(&open->channel);
    }
    mirrors_.push_back(open);
  }
  return opened;
}

// --- the flight ----------------------------------------------------------------------------------

void Hub::note(const RunView* run) {
  if (!run) {
    if (run_id_ && !has_left_)
      say(StatusLevel::kInfo, fmt::format("The server of run {:016x} has left.", *run_id_));
    has_left_ = true;
    return;
  }
  if (run_id_ != run->run.parameters.run_id()) begin_run(*run);
  has_left_ = false;
  note_silence(*run);
  if (!run->run.status) return;
  const std::string problem = run->run.status->problem().to_string();
  if (problem != problem_ && !problem.empty()) say(StatusLevel::kWarning, problem);
  problem_ = problem;
}

/// Ends the old run: sessions get a new sessionId, and the channels of its vehicles are closed. The
/// advertisement is sent even if it is empty, because Lichtblick forgets the types of its channels
/// with the session and collects them again at the next advertisement.
void Hub::begin_run(const RunView& run) {
  const Parameters& parameters = run.run.parameters;
  run_id_ = parameters.run_id();
  server_ = run.run.server;
  period_ns_ = parameters.period_ns();
  now_ns_ = 0;
  has_time_ = false;
  is_silent_ = false;
  problem_.clear();
  mirror_source_.emplace(list_vehicles(parameters), parameters);
  const auto closed = close_vanished_mirrors(mirror_source_->channels());
  const auto opened = open_mirrors(mirror_source_->channels());
  for (const auto& [client, seen] : clients_) {
    const auto send = [to = client](Payload text) {
      to->connection().send(MessageKind::kText, std::move(text), Delivery::kAlways);
    };
    send(make_server_info(session_id(), client->may_call()));
    if (!closed.empty()) send(make_unadvertise(closed));
    send(make_advertise(opened));
  }
  emit_static_mirrors();
  if (run.run.status) advance(calc_sim_time(run.run.status->step(), period_ns_));
}

void Hub::note_event(const RunEvent& event) {
  const std::string where =
      run_id_ == event.run_id && period_ns_ > 0
          ? fmt::format("{:.3f} s",
                        static_cast<double>(calc_sim_time(event.step, period_ns_)) * 1e-9)
          : fmt::format("step {}", event.step);
  const Payload payload = make_status(StatusLevel::kInfo, where + ": " + event.text);
  events_.push_back(payload);
  if (events_.size() > kMostEvents) events_.pop_front();
  send_all(payload);
}

void Hub::note_silence(const RunView& run) {
  if (run.is_silent == is_silent_) return;
  is_silent_ = run.is_silent;
  if (is_silent_)
    say(StatusLevel::kWarning,
        fmt::format("The server has been silent for {:.1f} s.", run.silence_s));
  else
    say(StatusLevel::kInfo, "The server is heard again.");
}

void Hub::note(const Sample& sample) {
  const std::int64_t time_ns = find_time(sample);
  const OpenChannel& channel = *natives_[static_cast<std::size_t>(sample.topic)];
  if (!channel.subscribers.empty()) broadcast(channel, time_ns, *sample.cdr);
  if (sample.topic == TopicId::kRecord && subscribed_mirrors_ > 0) emit_mirrors(sample);
  say_dropped();
}

void Hub::emit_mirrors(const Sample& sample) {
  const auto now = clock_();
  if (sample.sender != server_ || !mirror_source_ || !mirror_source_->is_due(now)) return;
  RecordBatch batch;
  if (!bus::decode(*sample.cdr, batch) || run_id_ != batch.run_id()) return;
  mirror_source_->note(
      batch, now,
      [this](std::size_t channel, std::int64_t time_ns, const std::vector<std::uint8_t>& cdr) {
        if (!mirrors_[channel]->subscribers.empty()) broadcast(*mirrors_[channel], time_ns, cdr);
      });
}

void Hub::emit_static_mirrors() {
  mirror_source_->emit_static(
      [this](std::size_t channel, std::int64_t time_ns, const std::vector<std::uint8_t>& cdr) {
        mirrors_[channel]->kept.push_back({time_ns, cdr});
        broadcast(*mirrors_[channel], time_ns, cdr);
      });
}

void Hub::broadcast(const OpenChannel& channel, std::int64_t time_ns,
                    const std::vector<std::uint8_t>& cdr) {
  const bool counts = channel.topic ? is_latched(*channel.topic) : !channel.kept.empty();
  const Delivery delivery = counts ? Delivery::kAlways : Delivery::kDroppable;
  Payload payload;
  std::uint32_t payload_of = 0;
  for (const Subscriber& subscriber : channel.subscribers) {
    if (!payload || payload_of != subscriber.subscription_id) {
      payload_of = subscriber.subscription_id;
      payload = make_message_data(payload_of, time_ns, cdr);
    }
    subscriber.client->connection().send(MessageKind::kBinary, payload, delivery);
  }
}

// --- time ----------------------------------------------------------------------------------------

/// Simulation time of a sample of the current run. For samples without a time and of other runs:
/// the newest simulation time at their arrival.
std::int64_t Hub::find_time(const Sample& sample) {
  const auto stamp = read_stamp(sample.topic, *sample.cdr);
  if (!stamp || run_id_ != stamp->run_id) return now_ns_;
  if (!stamp->sim_time_ns && !stamp->step) return now_ns_;
  const std::int64_t time_ns =
      stamp->sim_time_ns ? *stamp->sim_time_ns : calc_sim_time(*stamp->step, period_ns_);
  if (sample.sender == server_) advance(time_ns);
  return time_ns;
}

void Hub::advance(std::int64_t time_ns) {
  now_ns_ = std::max(now_ns_, time_ns);
  const auto now = clock_();
  if (has_time_ && now - time_sent_ < kTimeSpacing) return;
  has_time_ = true;
  time_sent_ = now;
  const Payload payload = make_time(now_ns_);
  for (const auto& [client, seen] : clients_)
    client->connection().send(MessageKind::kBinary, payload, Delivery::kDroppable);
}

// --- status messages -----------------------------------------------------------------------------

void Hub::send_all(const Payload& text) {
  for (const auto& [client, seen] : clients_)
    client->connection().send(MessageKind::kText, text, Delivery::kAlways);
}

void Hub::say(StatusLevel level, const std::string& text) { send_all(make_status(level, text)); }

void Hub::say_dropped() {
  const auto now = clock_();
  for (auto& [client, seen] : clients_) {
    const std::uint64_t dropped = client->connection().dropped();
    if (dropped == seen.dropped || now - seen.said < kDroppedSpacing) continue;
    const auto text =
        fmt::format("{} messages dropped: the client is slow", dropped - seen.dropped);
    seen = {dropped, now};
    client->connection().send(MessageKind::kText, make_status(StatusLevel::kWarning, text),
                              Delivery::kAlways);
  }
}

std::string Hub::session_id() const {
  return run_id_ ? fmt::format("{:016x}", *run_id_) : std::string("no run");
}

}  // namespace sls::view::foxglove
