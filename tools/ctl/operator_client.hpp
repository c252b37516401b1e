/// The operator's end of the domain: finds a run, asks for things, sees what becomes of it.
#pragma once

#include <chrono>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <mutex>
#include <optional>
#include <string>

#include "common/app/mailbox.hpp"
#include "common/app/wait.hpp"
#include "common/bus/node.hpp"
#include "common/bus/participants.hpp"
#include "tools/ctl/status_view.hpp"

namespace sls::ctl {

struct ClientOptions {
  int domain = 0;  ///< of the node, for messages
  std::uint32_t vehicle_id = 0;
  double timeout_s = 10.0;  ///< for a server to be found, and again for its reply
  bool asks = true;         ///< false: only reads, which the keys of every role allow
};

/// A stop signal ends every wait early; nothing is returned then.
class OperatorClient {
 public:
  OperatorClient(bus::Node& node, const ClientOptions& options);

  /// Waits for a run of the vehicle that is neither finished nor failed.
  /// @throws app::RunError if there is none in time.
  std::optional<bus::Run> wait_for_run() const;

  /// The same, but a run that has ended will do while there is no other.
  std::optional<bus::Run> wait_for_any_run() const;

  /// `run` with its last status; or the vehicle's run that followed it after a reset or the end of
  /// its server.
  bus::Run refresh(const bus::Run& run) const;

  /// Asks the server of `run` for `action` and waits for its reply; expects `asks`. Steps may take
  /// as long as they take, as long as the server gives signs of life.
  /// @throws app::RunError if no reply comes: server gone or deaf, run ended, out of time.
  std::optional<SimControlReply> ask(const bus::Run& run, ControlAction action,
                                     std::uint64_t steps = 0);

  /// The present knowledge of `run`.
  Snapshot make_snapshot(const bus::Run& run) const;

 private:
  /// The last reasons of one run.
  struct Events {
    std::string last_reason;
    std::deque<std::string> lines;
  };
  struct Received {
    SimControlReply reply;
    bus::PeerId sender;
  };
  /// sls/control, and sls/control_reply for `replies`.
  struct Channel {
    Channel(bus::Node& node, app::Mailbox<Received>& replies);
    bus::Reader<SimControlReply> reply_reader;
    bus::Writer<SimControl> request_writer;
  };
  using FindRun = std::function<std::optional<bus::Run>()>;

  std::optional<bus::Run> wait_for(const FindRun& find) const;
  std::optional<bus::Run> find_ended_run() const;
  void note_event(const SimStatus& status);
  /// False if a stop signal came before the server of `run` could be reached.
  bool wait_until_heard(const bus::Run& run, app::Wait& wait) const;
  void report_wait(const bus::Run& run, const SimControl& request, const app::Wait& wait) const;

  const ClientOptions options_;
  mutable std::mutex events_mutex_;         // they come on a thread of the middleware
  std::map<std::uint64_t, Events> events_;  // by run_id
  bus::ParticipantDirectory participants_;
  bus::ServerDirectory servers_;
  app::Mailbox<Received> replies_;
  std::optional<Channel> channel_;
};

/// USER@HOST, at most 64 bytes, for sls/control.
std::string make_operator_name();

/// "pause", "step", … of a request, for messages.
const char* to_string(ControlAction action);

}  // namespace sls::ctl
