/// Everything the server says and hears on the domain. The middleware's threads fill mailboxes,
/// which the server's one thread empties; and they do, in lockstep, what an answer allows at once
/// (lockstep_run.hpp).
#pragma once

#include <chrono>
#include <cstddef>
#include <functional>
#include <mutex>
#include <optional>

#include "common/app/mailbox.hpp"
#include "common/bus/node.hpp"
#include "common/bus/participants.hpp"
#include "common/config/scenario.hpp"
#include "sim_server/state_stream.hpp"

namespace sls::sim {

struct ReceivedCommand {
  ControlCommand command;
  bus::PeerId sender;
};

/// Commands in, of one vehicle's topic or of a fleet's.
class CommandStream {
 public:
  /// Sees a sample's commands first, on a thread of the middleware; true where it has taken them,
  /// else they go into the mailbox.
  using Handler =
      std::function<bool(const ControlCommand* commands, std::size_t count, const bus::PeerId&)>;

  CommandStream(bus::Node& node, std::size_t vehicles, config::SyncMode mode,
                app::Mailbox<ReceivedCommand>& mailbox);

  /// Puts `handler` in place of the one there was, which is not called any more on return.
  void set_handler(Handler handler);

  std::uint64_t missed_deadlines() const;
  std::optional<std::chrono::nanoseconds> lifespan() const;
  void ignore_lifespan();

 private:
  void receive(const ControlCommand* commands, std::size_t count, const bus::PeerId& sender);

  app::Mailbox<ReceivedCommand>& mailbox_;
  std::mutex mutex_;  // over handler_
  Handler handler_;
  std::optional<bus::Reader<ControlCommand>> vehicle_reader_;  // last: they call `receive`
  std::optional<bus::Reader<FleetCommand>> fleet_reader_;
};

struct Endpoints {
  static constexpr std::size_t kCommands = 4096;
  static constexpr std::size_t kRequests = 64;

  /// In real time commands are read with DEADLINE and LIFESPAN, where the QoS file has them.
  Endpoints(bus::Node& node, std::size_t vehicles, config::SyncMode mode)
      : domain(node),
        participants(node),
        servers(node),
        states(node, vehicles),
        parameters_writer(node),
        status_writer(node),
        reply_writer(node),
        commands(kCommands),
        requests(kRequests),
        command_stream(node, vehicles, mode, commands),
        request_reader(
            node, bus::kLatchedReaderProfile,
            [this](const SimControl& request, const bus::PeerId&) { requests.put(request); }) {}

  const bus::Node& domain;
  bus::ParticipantDirectory participants;
  bus::ServerDirectory servers;
  StateStream states;
  bus::Writer<Parameters> parameters_writer;
  bus::Writer<SimStatus> status_writer;
  bus::Writer<SimControlReply> reply_writer;
  app::Mailbox<ReceivedCommand> commands;
  app::Mailbox<SimControl> requests;
  CommandStream command_stream;
  bus::Reader<SimControl> request_reader;
};

}  // namespace sls::sim
