/// The operator's access to the domain: finds a run, sends requests, reads replies and status.
#pragma once

#include <chrono>
#include <cstdint>
#include <deque>
#include <functional>
#include <list>
#include <mutex>
#include <optional>
#include <string>

#include "common/app/mailbox.hpp"
#include "common/app/wait.hpp"
#include "common/bus/node.hpp"
#include "common/bus/participants.hpp"
#include "common/sync/server_watch.hpp"
#include "tools/ctl/status_view.hpp"

namespace sls::ctl {

struct ClientOptions {
  int domain = 0;  ///< domain of the node, for log messages
  std::uint32_t vehicle_id = 0;
  double timeout_s = 10.0;  ///< to find a server, and again for its reply
  bool asks = true;         ///< false: only reads, which the keys of every role allow
};

/// A stop signal ends every wait early; the function then returns nothing.
class OperatorClient {
 public:
  OperatorClient(bus::Node& node, const ClientOptions& options);

  /// Waits for a run of the vehicle that is neither finished nor failed.
  /// @throws app::RunError if there is none in time.
  std::optional<sync::Run> wait_for_run() const;

  /// The same, but returns a run that has ended if there is no other.
  std::optional<sync::Run> wait_for_any_run() const;

  /// `run` with its last status; after a reset or the end of its server, the vehicle's next run.
  sync::Run refresh(const sync::Run& run) const;

  /// Requests `action` from the server of `run` and waits for its reply; requires `asks`.
  /// ControlAction::ACTION_STEP has no timeout as long as the server publishes.
  /// @throws app::RunError if no reply comes: server gone or not matched, run ended, timeout.
  std::optional<SimControlReply> ask(const sync::Run& run, ControlAction action,
                                     std::uint64_t steps = 0);

  /// A request that has been sent, for find_reply.
  struct Question {
    sync::Run run;
    SimControl request;
    app::Wait wait;
    sync::ServerWatch server;
    std::optional<std::chrono::steady_clock::time_point> give_up;  ///< set once the run has ended
  };
  /// The two parts of `ask`, for several requests at a time, on one thread: `send` waits only for
  /// the server's endpoints, find_reply until `deadline`. @throws app::RunError as `ask`.
  std::optional<Question> send(const sync::Run& run, ControlAction action, std::uint64_t steps);
  std::optional<SimControlReply> find_reply(Question& question,
                                            std::chrono::steady_clock::time_point deadline);

  /// True if the announcement of every participant that can be known to exist has arrived.
  bool has_heard_everyone() const { return participants_.has_heard_everyone(); }

  /// The data of `run` that have arrived so far.
  Snapshot make_snapshot(const sync::Run& run) const;

 private:
  /// The last reasons of one run.
  struct Events {
    std::uint64_t run_id = 0;
    std::string last_reason;
    std::deque<std::string> lines;
  };
  struct Received {
    SimControlReply reply;
    bus::PeerId sender;
  };
  /// Writer of sls/control, and reader of sls/control_reply that fills `replies`.
  struct Channel {
    Channel(bus::Node& node, app::Mailbox<Received>& replies);
    bus::Reader<SimControlReply> reply_reader;
    bus::Writer<SimControl> request_writer;
  };
  using FindRun = std::function<std::optional<sync::Run>()>;

  std::optional<sync::Run> wait_for(const FindRun& find) const;
  void note_event(const SimStatus& status);
  Events& find_or_add_events(std::uint64_t run_id);
  bool keep_next_reply(std::chrono::steady_clock::time_point deadline);
  /// Waits until both endpoints match those of the server of `run`. False if a stop signal came
  /// first.
  bool wait_until_heard(const sync::Run& run, app::Wait& wait) const;
  void report_wait(const sync::Run& run, const SimControl& request, const app::Wait& wait) const;

  const ClientOptions options_;
  mutable std::mutex events_mutex_;  // events arrive on a thread of the middleware
  std::list<Events> events_;         // of the last runs, the one heard last at the end
  bus::ParticipantDirectory participants_;
  bus::ServerDirectory servers_;
  app::Mailbox<Received> replies_;
  std::deque<Received> kept_;  // taken from `replies_`, also those to other requests
  std::optional<Channel> channel_;
};

/// A run of the vehicle that has a status, also one that has ended.
std::optional<sync::Run> find_any_run(const bus::ServerDirectory& servers,
                                      std::uint32_t vehicle_id);

/// USER@HOST, at most 64 bytes, for sls/control.
std::string make_operator_name();

/// Name of a request for messages: "pause", "step", …
const char* to_string(ControlAction action);

}  // namespace sls::ctl
