#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <set>
#include <utility>
#include <variant>
#include <vector>

#include "common/bus/peer.hpp"
#include "sls.h"

namespace sls::record {

/// The samples for a recording that have arrived. A recorder's readers exist as long as itself: new
/// readers would receive all histories again, also those of earlier runs. So samples of a run that
/// may be opened next wait until it is opened. Those of the open run that find no room are counted
/// and dropped.
class Arrivals {
 public:
  using Sample = std::variant<RecordBatch, SimStatus>;
  struct Received {
    std::uint64_t run_id = 0;
    bus::PeerId sender;
    Sample sample;
  };

  /// Limit for the open run, and for all other runs together, in entries. It is larger than the
  /// lead of a server over its recorder. With 100 vehicles at 250 Hz it is 10 s.
  static constexpr std::size_t kMostEntries = 262'144;

  /// Samples of other runs than the open one are only kept if `may_be_opened` returns true.
  /// `most_entries`: smaller in simulated worlds.
  explicit Arrivals(std::function<bool(std::uint64_t run_id)> may_be_opened,
                    std::size_t most_entries = kMostEntries)
      : may_be_opened_(std::move(may_be_opened)), most_entries_(most_entries) {}

  void put(Received received);
  /// Makes `run_id` the open run. Its samples that have already arrived are included. Samples from
  /// other senders than its `server` are ignored.
  void open(std::uint64_t run_id, const bus::PeerId& server);
  /// The samples of the open run, oldest first.
  std::vector<Sample> take_all();

  /// Status samples and entries of the open run that were lost because there was no room.
  std::uint64_t refused() const { return refused_; }

 private:
  const std::function<bool(std::uint64_t)> may_be_opened_;
  const std::size_t most_entries_;
  std::vector<Sample> samples_;   // of the open run
  std::size_t size_ = 0;          // of samples_, in entries
  std::size_t refused_ = 0;       // dropped ones of the open run, in entries
  std::deque<Received> waiting_;  // samples of runs that may be opened
  std::size_t waiting_size_ = 0;
  std::set<std::uint64_t> closed_;  // runs that were open earlier
  std::uint64_t open_ = 0;
  bus::PeerId server_;
};

}  // namespace sls::record
