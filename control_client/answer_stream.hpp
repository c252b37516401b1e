/// The client's end of the control loop: states in, commands and references out; of one vehicle's
/// topics, or of a fleet's.
#pragma once

#include <chrono>
#include <cstddef>
#include <functional>
#include <optional>
#include <vector>

#include "common/bus/node.hpp"

namespace sls::control {

/// What a run decides about the topics that fly it.
struct LoopKind {
  bool is_fleet = false;
  bool is_realtime = false;

  bool operator==(const LoopKind& other) const {
    return is_fleet == other.is_fleet && is_realtime == other.is_realtime;
  }
};

class AnswerStream {
 public:
  /// Sees the states of one sample, on a thread of the middleware.
  using Handler =
      std::function<void(const VehicleState* states, std::size_t count, const bus::PeerId& sender)>;

  AnswerStream(bus::Node& node, const LoopKind& kind, Handler handler);

  const LoopKind& kind() const { return kind_; }

  /// Publishes the answers to the states of one sample, all of one step, in the order of both
  /// vectors, which it may leave empty.
  void write(std::vector<Reference>& references, std::vector<ControlCommand>& commands);

  /// True where `server` is heard and hears.
  bool sees_server(const bus::PeerId& server) const;
  /// True where `recorder` hears commands and references.
  bool sees_recorder(const bus::PeerId& recorder) const;

  void wait_for_acknowledgments(std::chrono::milliseconds limit);

 private:
  struct Vehicle {
    Vehicle(bus::Node& node, const char* command_profile, const Handler& handler);
    bus::Writer<Reference> references;
    bus::Writer<ControlCommand> commands;
    bus::Reader<VehicleState> states;
  };
  struct Fleet {
    Fleet(bus::Node& node, const char* command_profile, const Handler& handler);
    bus::Writer<FleetReference> references;
    bus::Writer<FleetCommand> commands;
    FleetReference reference_sample;
    FleetCommand command_sample;
    bus::Reader<FleetState> states;
  };

  template <class Look>
  bool look(Look look_at) const {
    return vehicle_ ? look_at(*vehicle_) : look_at(*fleet_);
  }

  const LoopKind kind_;
  std::optional<Vehicle> vehicle_;  // one of the two
  std::optional<Fleet> fleet_;
};

}  // namespace sls::control
