#include "sim_server/state_stream.hpp"

namespace sls::sim {
namespace {

/// Capacity of the queue to the writer thread, in samples: a second at 1 kHz and one per step.
constexpr std::size_t kQueuedSamples = 1024;

}  // namespace

void StateStream::begin_run(std::uint64_t run_id, std::int64_t period_ns, bool is_queued) {
  queue_ =
      is_queued ? std::make_unique<bus::QueuedWriter<States>>(writer_, kQueuedSamples) : nullptr;
  samples_.begin_run(run_id, period_ns);
}

void StateStream::write(const Fleet& fleet, const std::function<bool(std::size_t)>& is_wanted) {
  samples_.make(fleet, is_wanted, [this](const States& sample) {
    queue_ ? queue_->write(sample) : writer_.write(sample);
  });
}

}  // namespace sls::sim
