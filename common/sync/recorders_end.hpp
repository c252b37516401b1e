#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "common/sync/membership.hpp"
#include "common/sync/patience.hpp"

namespace sls::sync {

/// Longest waits for recorders, s.
struct RecorderPatience {
  double without_news = 10;  ///< without a new complete step, or after a stop signal
  double longest = 60;       ///< in total, because any program can announce steps
};

/// The end of a run: until its recorders are done, the server must keep its writers.
class RecordersEnd {
 public:
  RecordersEnd(Time now, int expected, const RecorderPatience& patience)
      : expected_(expected), wait_(now, patience.without_news), longest_(now, patience.longest) {}

  /// True once all `recorders` of the run that are present, and at least the expected number, are
  /// done, or the patience is over. `done`: those that have ended, also if they have left since.
  bool is_over(const std::vector<Member>& recorders, int done, bool is_stopped, Time now);

  /// A line about the recorders that are missing, if one is due.
  std::optional<std::string> take_report(const std::vector<Member>& recorders, Time now);

 private:
  const int expected_;
  Patience wait_;
  const Patience longest_;
  std::map<bus::PeerId, std::int64_t> last_steps_;
};

}  // namespace sls::sync
