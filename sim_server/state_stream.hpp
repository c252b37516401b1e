/// The states of a run on their way out: sls/state of one vehicle, sls/fleet_state of several.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "common/bus/node.hpp"
#include "common/bus/queued_writer.hpp"

namespace sls::sim {

class StateStream {
 public:
  /// Of `vehicles` vehicles, at least one.
  StateStream(bus::Node& node, std::size_t vehicles);

  /// The state of the `index`th vehicle, to be filled before it is written.
  VehicleState& at(std::size_t index);

  /// Publishes the states of all vehicles.
  void write() {
    write_where([](std::size_t) { return true; });
  }
  /// Publishes the samples that hold a vehicle of which `is_wanted(index)`.
  void write_where(const std::function<bool(std::size_t)>& is_wanted);

  /// While there is one, `write` hands samples to a thread of its own, by a queue for `steps`
  /// steps, and never blocks.
  class Queue {
   public:
    Queue(StateStream& stream, std::size_t steps);
    ~Queue();
    /// Samples that were lost so far.
    std::uint64_t lost() const;

   private:
    friend class StateStream;
    StateStream& stream_;
    std::optional<bus::QueuedWriter<VehicleState>> vehicle_;
    std::optional<bus::QueuedWriter<FleetState>> fleet_;
  };

  /// Steps of which the samples are kept for readers that are late.
  int history_depth() const;
  void wait_for_acknowledgments(std::chrono::milliseconds limit);

 private:
  bool is_fleet() const { return !fleet_.empty(); }

  std::optional<bus::Writer<VehicleState>> vehicle_writer_;
  std::optional<bus::Writer<FleetState>> fleet_writer_;
  VehicleState vehicle_;
  std::vector<FleetState> fleet_;  // as many vehicles in each as it may hold, the rest in the last
  Queue* queue_ = nullptr;
};

}  // namespace sls::sim
