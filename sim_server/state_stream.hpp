/// Publishes the states of a run.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <set>

#include "common/bus/node.hpp"
#include "common/bus/queued_writer.hpp"
#include "sim_server/state_samples.hpp"

namespace sls::sim {

class StateStream {
 public:
  explicit StateStream(bus::Node& node) : samples_(node.max_sample_bytes()), writer_(node) {}

  /// Begins a run. If `is_queued`, `write` never blocks from now on: it passes the samples to a
  /// separate thread, by a queue.
  void begin_run(std::uint64_t run_id, std::int64_t period_ns, bool is_queued);

  /// Publishes the states of the step in work: the samples that hold a vehicle for which
  /// `is_wanted(index)` is true.
  void write(const Fleet& fleet, const std::function<bool(std::size_t)>& is_wanted);

  /// Samples of the run that were lost so far.
  std::uint64_t lost() const { return queue_ ? queue_->lost() : 0; }

  /// Participants with a reader that is matched with this writer.
  std::set<bus::PeerId> matched() const { return writer_.matched(); }

 private:
  StateSamples samples_;
  bus::Writer<States> writer_;
  std::unique_ptr<bus::QueuedWriter<States>> queue_;
};

}  // namespace sls::sim
