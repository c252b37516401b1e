#pragma once

#include <chrono>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <utility>

#include "common/app/awake_clock.hpp"
#include "common/sync/membership.hpp"
#include "common/sync/servers.hpp"
#include "worlds/plan.hpp"
#include "worlds/setting.hpp"

namespace sls::worlds {

/// A program in a world: the shell around a core, on one process, with one participant. Its main
/// thread wakes when it is due; a slow processor makes it wait.
class Program {
 public:
  Program(Setting& setting, Host& host, Role role, std::string name)
      : setting_(setting),
        process_(setting.timeline, host, std::move(name)),
        peer_(setting.network.join(process_)),
        servers_(peer_.id()),
        role_(role) {}
  virtual ~Program() = default;
  Program(const Program&) = delete;
  Program& operator=(const Program&) = delete;

  virtual void start() = 0;
  /// SIGSTOP and SIGCONT.
  void stop();
  void go_on();
  Process& process() { return process_; }
  const Process& process() const { return process_; }
  const bus::PeerId& id() const { return peer_.id(); }
  const Peer& peer() const { return peer_; }
  /// A client or recorder has discovered the endpoints of `server` that it needs.
  bool sees(const bus::PeerId& server) const;
  const std::string& name() const { return process_.name(); }
  Role role() const { return role_; }

  /// SIGINT: the program ends as if a user had pressed Ctrl-C.
  void interrupt();
  /// SIGKILL.
  void kill();
  bool was_killed() const { return process_.was_killed(); }
  bool was_interrupted() const { return !stop_signal_.empty(); }
  /// After its end, unless it was killed.
  std::optional<int> exit_code() const { return exit_code_; }
  const std::string& reason() const { return reason_; }
  Instant ended() const { return ended_; }
  /// Extra time that the processor takes for each wake-up.
  void set_slowness(Instant delay);
  bool is_slow() const { return slowness_ > Instant(0); }
  /// Time of the world without its stops of 0.5 s and more, which no deadline may count.
  Instant awake() const;
  /// When a status of the run came last from `server`, in that time.
  std::optional<Instant> find_heard(std::uint64_t run_id, const bus::PeerId& server) const;

 protected:
  /// Awake time of this program.
  sync::Time now() const { return clock_.look(process_.host().now()); }
  void say(std::string text);
  void say(const sync::Line& line);
  /// Wakes the main thread at `time` of this host's clock, or earlier if that was asked for.
  void wake_at(sync::Time time);
  void wake_soon() { wake_at(now()); }
  virtual void wake() = 0;
  void exit(int code, std::string reason);
  /// Closes the files of the process.
  virtual void on_killed() {}

  void announce(const Participant& message);
  /// As bus::Announcer.
  void repeat_announcement_if_due();

  const sync::Servers& present_servers();
  sync::Membership& present_members();
  /// Reads the topic of `Message` with `note`.
  template <class Message>
  void read() {
    peer_.add_reader<Message>(
        [this](const Message& sample, const Peer::Arrival& arrival) { note(sample, arrival); });
  }
  void note(const Parameters& sample, const Peer::Arrival& arrival);
  void note(const SimStatus& sample, const Peer::Arrival& arrival);
  void note(const Participant& sample, const Peer::Arrival& arrival);

  Setting& setting_;
  Process process_;
  Peer& peer_;
  sync::Servers servers_;
  sync::Membership members_;
  std::string stop_signal_;
  mutable app::AwakeClock clock_;

 private:
  void look_for_unclaimed();

  const Role role_;
  sync::Time looked_for_unclaimed_{};
  Instant slowness_{0};
  Instant wakes_{Instant::max()};
  std::uint64_t wake_number_ = 0;
  std::optional<Participant> announced_;
  sync::Time announced_time_;
  std::optional<int> exit_code_;
  std::string reason_;
  Instant ended_{0};
  Instant stopped_since_{0}, stopped_{0};
  std::map<std::pair<std::uint64_t, bus::PeerId>, Instant> heard_;  // the last status, awake
};

}  // namespace sls::worlds
