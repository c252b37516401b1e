#pragma once

#include <cstdint>
#include <functional>
#include <mutex>

#include "common/bus/node.hpp"
#include "recorder/core/arrivals.hpp"
#include "recorder/recording.hpp"

namespace sls::record {

/// The way of the samples from the middleware's threads to the writing thread: Arrivals behind a
/// lock. A sample is added without blocking.
class Inbox {
 public:
  /// As of Arrivals. `may_be_opened` is called on the middleware's threads.
  Inbox(bus::Node& node, std::function<bool(std::uint64_t run_id)> may_be_opened);

  void open(std::uint64_t run_id, const bus::PeerId& server);

  /// Adds all waiting samples of the open run to `recording`, oldest first; false if there are
  /// none.
  bool empty_into(Recording& recording);

  std::uint64_t refused() const;

  /// True if both readers are matched with `server`.
  bool hears(const bus::PeerId& server) const;

 private:
  void put(Arrivals::Received received);

  mutable std::mutex mutex_;
  Arrivals arrivals_;  // under the mutex
  bus::Reader<RecordBatch> record_reader_;
  bus::Reader<SimStatus> status_reader_;
};

}  // namespace sls::record
