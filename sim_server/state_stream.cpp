#include "sim_server/state_stream.hpp"

#include <algorithm>

#include "common/bus/convert.hpp"
#include "common/bus/message_size.hpp"

namespace sls::sim {
namespace {

/// Capacity of the queue to the writer thread, in samples: a second at 1 kHz and one per step.
constexpr std::size_t kQueuedSamples = 1024;

}  // namespace

void StateStream::begin_run(std::uint64_t run_id, std::int64_t period_ns, bool is_queued) {
  queue_ =
      is_queued ? std::make_unique<bus::QueuedWriter<States>>(writer_, kQueuedSamples) : nullptr;
  sample_.run_id(run_id);
  period_ns_ = period_ns;
}

void StateStream::write(const Fleet& fleet, const std::function<bool(std::size_t)>& is_wanted) {
  const std::vector<model::StepRecord>& records = fleet.records();
  sample_.step(fleet.step());
  sample_.sim_time_ns(static_cast<std::int64_t>(fleet.step()) * period_ns_);
  std::size_t most = 1;
  for (std::size_t first = 0, end = 0; first < records.size(); first = end) {
    if (first == 0) {  // all vehicles have states of equal size
      sample_.vehicles().resize(1);
      bus::fill(sample_.vehicles().front(), records.front());
      most = std::clamp<std::size_t>(max_bytes_ / bus::calc_size(sample_.vehicles().front()), 1,
                                     std::size_t{SAMPLE_VEHICLES});
    }
    end = std::min(first + most, records.size());
    bool is_sample_wanted = false;
    for (std::size_t i = first; i < end; ++i) is_sample_wanted = is_sample_wanted || is_wanted(i);
    if (!is_sample_wanted) continue;
    sample_.vehicles().resize(end - first);
    for (std::size_t i = first; i < end; ++i) bus::fill(sample_.vehicles()[i - first], records[i]);
    queue_ ? queue_->write(sample_) : writer_.write(sample_);
  }
}

}  // namespace sls::sim
