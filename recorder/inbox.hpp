#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <mutex>
#include <set>
#include <variant>

#include "common/bus/node.hpp"

namespace sls::record {

/// Samples of the open run, on their way from the middleware's threads to the writing
/// one. The readers live as long as the recorder: new ones would be sent all histories again, of
/// earlier runs too. So samples of a run that may be opened next wait for that. Putting never
/// blocks; what does not fit of the open run is counted.
class Inbox {
 public:
  using Sample = std::variant<RecordBatch, SimStatus>;

  /// `may_be_opened` is asked about runs on the middleware's threads: others are not kept.
  Inbox(bus::Node& node, std::function<bool(std::uint64_t run_id)> may_be_opened);

  /// From now on run `run_id` is recorded, including its samples that have already arrived. Samples
  /// count from its `server` alone.
  void open(std::uint64_t run_id, const bus::PeerId& server);

  /// All samples of the open run there are, oldest first.
  std::deque<Sample> take_all();

  /// Status samples and entries of the open run that were lost because there was no room.
  std::uint64_t refused() const;

  /// True if the readers hear `server`.
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
  std::size_t size_ = 0;          // of those, counting entries
  std::size_t refused_ = 0;       // likewise, of the open run
  std::deque<Received> waiting_;  // of runs that may be opened
  std::size_t waiting_size_ = 0;
  std::set<std::uint64_t> closed_;  // have been open
  std::uint64_t open_ = 0;
  bus::PeerId server_;
  bus::Reader<RecordBatch> record_reader_;
  bus::Reader<SimStatus> status_reader_;
};

}  // namespace sls::record
