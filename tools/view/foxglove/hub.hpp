/// Shared by all sessions of the protocol: the channels and their subscribers. Does the work for
/// each sample once, for any number of subscribers.
#pragma once

#include <chrono>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "tools/view/foxglove/messages.hpp"
#include "tools/view/foxglove/mirror_source.hpp"
#include "tools/view/live/feed.hpp"
#include "tools/view/live/operator.hpp"

namespace sls::view::foxglove {

/// Interface of a session for the hub.
class Client {
 public:
  virtual ~Client() = default;
  virtual Connection& connection() = 0;
  virtual bool may_call() const = 0;
  /// The hub ended this subscription: its channel is gone.
  virtual void forget(std::uint32_t subscription_id) = 0;
};

class Hub final : public Feed::Listener {
 public:
  using Clock = std::function<std::chrono::steady_clock::time_point()>;

  /// Feed and operator must outlive the hub.
  Hub(Feed& feed, Operator& requests, Clock clock = std::chrono::steady_clock::now);

  /// Sends a new client the server, the channels, the status and the past events.
  void add(Client& client);
  void remove(Client& client);
  /// Begins to send; sends latched topics at once. Returns nothing, or the error as text.
  std::optional<std::string> subscribe(Client& client, const Subscribe::Item& item);
  /// False if there is no such subscription.
  bool unsubscribe(Client& client, std::uint32_t subscription_id);

  Operator& requests() { return requests_; }

  void note(const Sample& sample) override;
  void note(const RunView* run) override;
  void note_event(const RunEvent& event) override;

 private:
  struct Subscriber {
    Client* client;
    std::uint32_t subscription_id;
  };
  struct Kept {
    std::int64_t time_ns;
    std::vector<std::uint8_t> cdr;
  };
  struct OpenChannel {
    Channel channel;
    std::optional<TopicId> topic;  ///< none: a mirror
    std::vector<Subscriber> subscribers;
    std::vector<Kept> kept;  ///< messages of a latched mirror
  };
  using Time = std::chrono::steady_clock::time_point;

  OpenChannel& open_channel(Channel channel);
  void add_native_channels();
  void greet(Client& client);
  void begin_run(const RunView& run);
  std::vector<std::uint32_t> close_vanished_mirrors(const std::vector<ros::Channel>& wanted);
  std::vector<const Channel*> open_mirrors(const std::vector<ros::Channel>& wanted);
  void close_subscriptions(OpenChannel& channel);
  void note_wanted(const OpenChannel& channel, bool is_wanted);
  void send_kept(const OpenChannel& channel, const Subscriber& subscriber);
  void broadcast(const OpenChannel& channel, std::int64_t time_ns,
                 const std::vector<std::uint8_t>& cdr);
  void emit_mirrors(const Sample& sample);
  void emit_static_mirrors();
  std::int64_t find_time(const Sample& sample);
  void advance(std::int64_t time_ns);
  void send_all(const Payload& text);
  void say(StatusLevel level, const std::string& text);
  void say_dropped();
  void note_silence(const RunView& run);
  std::string session_id() const;

  Feed& feed_;
  Operator& requests_;
  const Clock clock_;
  std::map<std::uint32_t, OpenChannel> channels_;  // by id
  std::vector<OpenChannel*> natives_;              // by TopicId
  std::vector<OpenChannel*> mirrors_;              // in the order of MirrorSource::channels
  Payload advertisement_;                          // of all channels; null: to be made
  std::uint32_t next_channel_id_ = 1;
  std::size_t subscribed_mirrors_ = 0;

  std::optional<std::uint64_t> run_id_;
  bus::PeerId server_;
  std::int64_t period_ns_ = 0;
  std::optional<MirrorSource> mirror_source_;
  std::int64_t now_ns_ = 0;  // newest simulation time of the run
  bool has_time_ = false;
  Time time_sent_{};
  bool has_left_ = false;  // the server of the run has left
  bool is_silent_ = false;
  std::string problem_;
  std::deque<Payload> events_;  // for clients that join later

  struct Seen {
    std::uint64_t dropped = 0;
    Time said{};
  };
  std::map<Client*, Seen> clients_;
};

}  // namespace sls::view::foxglove
