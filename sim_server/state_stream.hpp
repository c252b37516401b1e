/// Publishes the states of a run.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <set>
#include <vector>

#include "common/bus/convert.hpp"
#include "common/bus/message_size.hpp"
#include "common/bus/node.hpp"
#include "common/bus/queued_writer.hpp"
#include "sim_server/core/step/fleet.hpp"

namespace sls::sim {

/// The samples of sls/state of a step. One holds as many vehicles as fit into a datagram.
class StateSamples {
 public:
  /// Samples have at most `max_bytes`, unless one vehicle is larger.
  explicit StateSamples(std::size_t max_bytes) : max_bytes_(max_bytes) {}

  void begin_run(std::uint64_t run_id, std::int64_t period_ns) {
    sample_.run_id(run_id);
    period_ns_ = period_ns;
  }

  /// Calls `write(sample)` with the samples of the step in work that hold a vehicle for which
  /// `is_wanted(index)` is true.
  template <class IsWanted, class Write>
  void make(const Fleet& fleet, const IsWanted& is_wanted, const Write& write) {
    const std::vector<model::StepRecord>& records = fleet.records();
    sample_.step(fleet.step());
    sample_.sim_time_ns(static_cast<std::int64_t>(fleet.step()) * period_ns_);
    sample_.vehicles().resize(1);
    bus::fill(sample_.vehicles().front(), records.front());
    std::size_t most = 1;
    if (records.size() > 1)  // all vehicles have states of equal size
      most = std::clamp<std::size_t>(max_bytes_ / bus::calc_size(sample_.vehicles().front()), 1,
                                     std::size_t{SAMPLE_VEHICLES});
    for (std::size_t first = 0, end = 0; first < records.size(); first = end) {
      end = std::min(first + most, records.size());
      bool is_sample_wanted = false;
      for (std::size_t i = first; i < end; ++i) is_sample_wanted = is_sample_wanted || is_wanted(i);
      if (!is_sample_wanted) continue;
      sample_.vehicles().resize(end - first);
      for (std::size_t i = std::max<std::size_t>(first, 1); i < end; ++i)
        bus::fill(sample_.vehicles()[i - first], records[i]);
      write(sample_);
    }
  }

 private:
  const std::size_t max_bytes_;
  std::int64_t period_ns_ = 0;
  States sample_;
};

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
