/// Publishes the states of a run. A sample of sls/state holds as many vehicles as fit into a
/// datagram.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <set>
#include <vector>

#include "common/bus/node.hpp"
#include "common/bus/queued_writer.hpp"

namespace sls::sim {

class StateStream {
 public:
  /// `vehicles`: their number, at least one.
  StateStream(bus::Node& node, std::size_t vehicles)
      : max_bytes_(node.max_sample_bytes()), writer_(node), vehicles_(vehicles) {}

  /// The state of the `index`th vehicle, to be filled before it is written.
  VehicleState& at(std::size_t index) { return vehicles_[index]; }

  /// Sets the step of the states.
  void set_step(std::uint64_t run_id, std::uint64_t step, std::int64_t sim_time_ns);

  /// Publishes the states of all vehicles.
  void write() {
    write_where([](std::size_t) { return true; });
  }
  /// Publishes the samples that hold a vehicle for which `is_wanted(index)` is true.
  void write_where(const std::function<bool(std::size_t)>& is_wanted);

  /// Participants with a reader that is matched with this writer.
  std::set<bus::PeerId> matched() const { return writer_.matched(); }

  /// While a Queue exists, `write` never blocks: it passes the samples to a separate thread, by a
  /// queue with room for `samples` of them.
  class Queue {
   public:
    Queue(StateStream& stream, std::size_t samples);
    ~Queue();
    /// Samples that were lost so far.
    std::uint64_t lost() const { return writer_.lost(); }

   private:
    friend class StateStream;
    StateStream& stream_;
    bus::QueuedWriter<States> writer_;
  };

 private:
  const std::size_t max_bytes_;
  bus::Writer<States> writer_;
  std::vector<VehicleState> vehicles_;
  States sample_;
  Queue* queue_ = nullptr;
};

}  // namespace sls::sim
