/// All endpoints of the server on the domain. The middleware's threads fill mailboxes; the server's
/// main thread empties them. In lockstep the middleware's threads also apply answers
/// (lockstep_run.hpp).
#pragma once

#include <chrono>
#include <cstddef>
#include <functional>
#include <map>
#include <mutex>
#include <optional>
#include <set>

#include "common/app/mailbox.hpp"
#include "common/bus/node.hpp"
#include "common/bus/participants.hpp"
#include "common/config/scenario.hpp"
#include "sim_server/core/stamp_check.hpp"
#include "sim_server/state_stream.hpp"

namespace sls::sim {

struct ReceivedCommands {
  Commands sample;
  bus::PeerId sender;
  std::chrono::steady_clock::time_point arrived;
  std::chrono::system_clock::time_point written;  ///< by the sender's clock
};

/// Receives the commands.
class CommandStream {
 public:
  /// Gets each sample first, on a thread of the middleware. Returns true if it has handled the
  /// sample; otherwise the sample goes into the mailbox.
  using Handler = std::function<bool(const Commands& sample, const bus::PeerId& sender)>;

  CommandStream(bus::Node& node, config::SyncMode mode, app::Mailbox<ReceivedCommands>& mailbox);

  /// Replaces the handler. After the return the previous one is not called any more.
  void set_handler(Handler handler);

  /// Participants with a writer that this reader has matched.
  std::set<bus::PeerId> matched() const { return reader_.matched(); }

  std::uint64_t missed_deadlines() const { return reader_.missed_deadlines(); }
  std::optional<std::chrono::nanoseconds> lifespan() const { return reader_.lifespan(); }
  void ignore_lifespan(bool is_ignored) { reader_.ignore_lifespan(is_ignored); }

  /// Senders of commands with a source timestamp in the future since the last call: how far ahead
  /// of our clock, s.
  std::map<bus::PeerId, double> take_stamps_ahead();

 private:
  void receive(const Commands& sample, const bus::PeerId& sender);

  app::Mailbox<ReceivedCommands>& mailbox_;
  std::mutex mutex_;  // protects the members below
  Handler handler_;
  StampCheck stamps_;
  bus::Reader<Commands> reader_;  // last: it calls `receive`
};

struct Endpoints {
  static constexpr std::size_t kCommands = 4096;
  static constexpr std::size_t kRequests = 64;

  /// In real time commands are read with DEADLINE and LIFESPAN, if the QoS file has them.
  Endpoints(bus::Node& node, std::size_t vehicles, config::SyncMode mode)
      : domain(node),
        commands(kCommands),
        command_stream(node, mode, commands),
        parameters_writer(node),
        participants(node),
        servers(node),
        states(node, vehicles),
        record_writer(node),
        status_writer(node),
        reply_writer(node),
        requests(kRequests),
        request_reader(
            node, bus::kLatchedReaderProfile,
            [this](const SimControl& request, const bus::PeerId&) { requests.put(request); }) {}

  bus::Node& domain;
  // The order is that in which another program discovers the endpoints. One that knows the writer
  // of status knows all those before it. A participant with one of the other writers, but without
  // that of parameters, is no server (bus::ServerDirectory::look_for_impostors).
  app::Mailbox<ReceivedCommands> commands;
  CommandStream command_stream;
  bus::Writer<Parameters> parameters_writer;
  bus::ParticipantDirectory participants;
  bus::ServerDirectory servers;
  StateStream states;
  bus::Writer<RecordBatch> record_writer;
  bus::Writer<SimStatus> status_writer;
  bus::Writer<SimControlReply> reply_writer;
  app::Mailbox<SimControl> requests;
  bus::Reader<SimControl> request_reader;
};

}  // namespace sls::sim
