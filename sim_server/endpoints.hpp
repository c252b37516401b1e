/// All endpoints of the server on the domain.
#pragma once

#include <functional>

#include "common/bus/node.hpp"
#include "common/bus/participants.hpp"
#include "common/config/scenario.hpp"
#include "sim_server/state_stream.hpp"

namespace sls::sim {

struct Endpoints {
  /// In real time commands are read with DEADLINE and LIFESPAN, if the QoS file has them. The
  /// handlers are called on threads of the middleware, from now on.
  Endpoints(bus::Node& node, config::SyncMode mode,
            std::function<void(const Commands&, const bus::PeerId&)> on_commands,
            std::function<void(const SimControl&)> on_request)
      : domain(node),
        commands(node,
                 mode == config::SyncMode::kRealtime
                     ? node.choose_reader_profile(bus::kRealtimeCommandReaderProfile,
                                                  bus::kLoopReaderProfile)
                     : bus::kLoopReaderProfile,
                 std::move(on_commands)),
        parameters(node),
        participants(node),
        servers(node),
        states(node),
        records(node),
        status(node),
        replies(node),
        requests(node, bus::kLatchedReaderProfile,
                 [on_request = std::move(on_request)](
                     const SimControl& request, const bus::PeerId&) { on_request(request); }) {}

  bus::Node& domain;
  // The order is that in which another program discovers the endpoints. One that knows the writer
  // of status knows all those before it. A participant with one of the other writers, but without
  // that of parameters, is no server (bus::ServerDirectory::look_for_impostors).
  bus::Reader<Commands> commands;
  bus::Writer<Parameters> parameters;
  bus::ParticipantDirectory participants;
  bus::ServerDirectory servers;
  StateStream states;
  bus::Writer<RecordBatch> records;
  bus::Writer<SimStatus> status;
  bus::Writer<SimControlReply> replies;
  bus::Reader<SimControl> requests;
};

}  // namespace sls::sim
