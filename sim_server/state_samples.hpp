/// The samples of sls/state of a step. One holds as many vehicles as fit into a datagram.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "common/bus/convert.hpp"
#include "common/bus/message_size.hpp"
#include "sim_server/core/fleet.hpp"

namespace sls::sim {

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
      for (std::size_t i = first; i < end; ++i)
        bus::fill(sample_.vehicles()[i - first], records[i]);
      write(sample_);
    }
  }

 private:
  const std::size_t max_bytes_;
  std::int64_t period_ns_ = 0;
  States sample_;
};

}  // namespace sls::sim
