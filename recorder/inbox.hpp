#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <mutex>
#include <set>
#include <variant>

#include "common/bus/node.hpp"
#include "recorder/recording.hpp"

namespace sls::record {

/// A queue of samples of the open run, from the middleware's threads to the writing thread. The
/// readers exist as long as the recorder: new readers would receive all histories again, also those
/// of earlier runs. So samples of a run that may be opened next wait until it is opened. A sample
/// is added without blocking; samples of the open run that find no room are counted and dropped.
class Inbox {
 public:
  using Sample = std::variant<RecordBatch, SimStatus>;

  /// Samples of other runs are only kept if `may_be_opened` returns true. It is called on the
  /// middleware's threads.
  Inbox(bus::Node& node, std::function<bool(std::uint64_t run_id)> may_be_opened);

  /// Makes `run_id` the open run. Its samples that have already arrived are included. Samples from
  /// other senders than its `server` are ignored.
  void open(std::uint64_t run_id, const bus::PeerId& server);

  /// Adds all waiting samples of the open run to `recording`, oldest first; false if there are
  /// none.
  bool empty_into(Recording& recording);

  /// Status samples and entries of the open run that were lost because there was no room.
  std::uint64_t refused() const;

  /// True if both readers are matched with `server`.
  bool hears(const bus::PeerId& server) const;

 private:
  struct Received {
    std::uint64_t run_id = 0;
    bus::PeerId sender;
    Sample sample;
  };
  void put(Received received);
  void put_locked(Received received);

  const std::function<bool(std::uint64_t)> may_be_opened_;
  mutable std::mutex mutex_;
  std::deque<Sample> samples_;    // of the open run
  std::size_t size_ = 0;          // of samples_, in entries
  std::size_t refused_ = 0;       // dropped ones of the open run, in entries
  std::deque<Received> waiting_;  // samples of runs that may be opened
  std::size_t waiting_size_ = 0;
  std::set<std::uint64_t> closed_;  // runs that were open earlier
  std::uint64_t open_ = 0;
  bus::PeerId server_;
  bus::Reader<RecordBatch> record_reader_;
  bus::Reader<SimStatus> status_reader_;
};

}  // namespace sls::record
