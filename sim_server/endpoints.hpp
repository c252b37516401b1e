/// Everything the server says and hears on the domain. The middleware's threads only fill
/// mailboxes; the server's one thread empties them.
#pragma once

#include <chrono>
#include <cstddef>

#include "common/app/mailbox.hpp"
#include "common/bus/node.hpp"
#include "common/bus/participants.hpp"
#include "common/config/scenario.hpp"

namespace sls::sim {

struct ReceivedCommand {
  ControlCommand command;
  bus::PeerId sender;
};

struct Endpoints {
  static constexpr std::size_t kCommands = 4096;
  static constexpr std::size_t kRequests = 64;

  /// In real time commands are read with DEADLINE and LIFESPAN, where the QoS file has them.
  Endpoints(bus::Node& node, config::SyncMode mode)
      : domain(node),
        participants(node),
        servers(node),
        state_writer(node),
        parameters_writer(node),
        status_writer(node),
        reply_writer(node),
        commands(kCommands),
        requests(kRequests),
        command_reader(node,
                       mode == config::SyncMode::kRealtime
                           ? node.choose_reader_profile(bus::kRealtimeCommandReaderProfile,
                                                        bus::kLoopReaderProfile)
                           : bus::kLoopReaderProfile,
                       [this](const ControlCommand& command, const bus::PeerId& sender) {
                         commands.put({command, sender});
                       }),
        request_reader(
            node, bus::kLatchedReaderProfile,
            [this](const SimControl& request, const bus::PeerId&) { requests.put(request); }) {}

  const bus::Node& domain;
  bus::ParticipantDirectory participants;
  bus::ServerDirectory servers;
  bus::Writer<VehicleState> state_writer;
  bus::Writer<Parameters> parameters_writer;
  bus::Writer<SimStatus> status_writer;
  bus::Writer<SimControlReply> reply_writer;
  app::Mailbox<ReceivedCommand> commands;
  app::Mailbox<SimControl> requests;
  bus::Reader<ControlCommand> command_reader;
  bus::Reader<SimControl> request_reader;
};

}  // namespace sls::sim
