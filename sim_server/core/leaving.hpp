#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "common/sync/line.hpp"
#include "common/sync/membership.hpp"
#include "common/sync/patience.hpp"

namespace sls::sim {

/// The end of a server, after its last run: it keeps its writers until the recorders are done and
/// all readers have acknowledged what it wrote.
class Leaving {
 public:
  /// Longest waits, s.
  static constexpr double kWithoutNews = 10;  ///< for recorders that complete no further step, or
                                              ///< after a stop signal
  static constexpr double kLongest = 60;      ///< in total: any program can announce steps
  static constexpr auto kAcknowledgement = std::chrono::seconds(2);

  /// The run has ended at `now`. `expected` recorders must get all of it; it `is_failure` if they
  /// do not.
  Leaving(int expected, bool is_failure, sync::Time now)
      : expected_(expected),
        is_failure_(is_failure),
        wait_(now, kWithoutNews),
        longest_(now, kLongest) {}

  struct Around {
    std::vector<sync::Member> recorders;  ///< of the run, present
    int done = 0;  ///< recorders of the run that have ended, also those that have left since
    bool is_stopped = false;       ///< a stop signal came
    bool is_acknowledged = false;  ///< all readers have got what was written
  };
  /// True once the server may leave. Call it several times a second.
  bool look(const Around& around, sync::Time now);

  /// After the end: why the server fails although its run finished; empty if it does not.
  const std::string& error() const { return error_; }
  std::vector<sync::Line> take_lines() { return std::exchange(lines_, {}); }

 private:
  bool are_recorders_done(const Around& around, sync::Time now);
  bool get_further(const std::vector<sync::Member>& recorders);

  const int expected_;
  const bool is_failure_;
  sync::Patience wait_;
  const sync::Patience longest_;
  std::map<bus::PeerId, std::int64_t> last_steps_;
  std::optional<sync::Time> recorders_done_;
  std::string error_;
  std::vector<sync::Line> lines_;
};

}  // namespace sls::sim
