#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <mutex>
#include <set>
#include <variant>

#include "common/bus/node.hpp"

namespace sls::record {

/// What the topics bring of the open run, on its way from the middleware's threads to the writing
/// one; a fleet's samples vehicle by vehicle. The readers live as long as the recorder: new ones
/// would be sent all histories again, of earlier runs too. So samples of a run that may be opened
/// next wait for that. Putting never blocks; samples of the open run that do not fit are counted.
class Inbox {
 public:
  using Sample = std::variant<VehicleState, ControlCommand, Reference, SimStatus>;

  /// `may_be_opened` is asked about runs on the middleware's threads: others are not kept.
  Inbox(bus::Node& node, std::function<bool(std::uint64_t run_id)> may_be_opened);

  /// From now on run `run_id` is recorded, what has come of it so far included. States and status
  /// samples count from its `server` alone: only that knows where the run is.
  void open(std::uint64_t run_id, const bus::PeerId& server);

  struct Received {
    Sample sample;
    bus::PeerId sender;
  };

  /// All samples of the open run there are, oldest first.
  std::deque<Received> take_all();

  /// Samples of the open run that were lost because there was no room.
  std::uint64_t refused() const;

  /// True where the reader of states, of a fleet's where the run `is_fleet`, hears `server`.
  bool hears_server(const bus::PeerId& server, bool is_fleet) const;
  /// True where the readers of both commands and references hear `client`.
  bool hears_client(const bus::PeerId& client, bool is_fleet) const;

 private:
  template <class Vehicle>
  void put(const Vehicle* samples, std::size_t count, const bus::PeerId& sender);
  bool belongs(const Received& received) const;

  const std::function<bool(std::uint64_t)> may_be_opened_;
  mutable std::mutex mutex_;
  std::deque<Received> samples_;    // of the open run
  std::uint64_t refused_ = 0;       // likewise
  std::deque<Received> waiting_;    // of runs that may be opened
  std::set<std::uint64_t> closed_;  // have been open
  std::uint64_t open_ = 0;
  bus::PeerId server_;
  bus::Reader<VehicleState> state_reader_;
  bus::Reader<ControlCommand> command_reader_;
  bus::Reader<Reference> reference_reader_;
  bus::Reader<FleetState> fleet_state_reader_;
  bus::Reader<FleetCommand> fleet_command_reader_;
  bus::Reader<FleetReference> fleet_reference_reader_;
  bus::Reader<SimStatus> status_reader_;
};

}  // namespace sls::record
