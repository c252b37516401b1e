#pragma once

#include <cstdint>
#include <limits>
#include <optional>
#include <string>

#include "common/config/scenario.hpp"
#include "common/sync/patience.hpp"
#include "sim_server/core/participants/roster.hpp"
#include "sim_server/core/report/run_report.hpp"

namespace sls::sim {

/// Whether the recorders allow a step to be published, and what a run does if they do not for long.
/// Rules: docs/synchronisation.md, "Recording" and "Waiting for participants".
class RecorderWait {
 public:
  RecorderWait(const config::Sync& sync, RunReport& report) : sync_(sync), report_(report) {}

  /// Call after each refresh of the roster. Records of `history_steps` are kept for late recorders.
  void update(const Roster& roster, std::uint64_t history_steps);

  /// The number of record entries sent so far. While it grows, only the network is slow.
  void note_written(std::uint64_t written) { written_ = written; }

  /// The run was at rest for `rest`, which does not count.
  void note_rest(sync::Duration rest) {
    for (Wait* wait : {&full_, &behind_})
      if (wait->patience) wait->patience->extend(rest);
  }

  /// True if `step` may be published. `is_full`: the records of the last steps are far from being
  /// sent.
  /// @throws std::runtime_error if the recorders were waited for too long.
  bool allows(const Roster& roster, std::uint64_t step, bool is_full, sync::Time now);

  /// Number of recorders that must get the whole run; 0 once they were given up.
  int expected() const { return behind_.is_given_up ? 0 : sync_.wait_for.recorders; }

 private:
  /// A cause for which a lockstep run waits.
  struct Wait {
    std::optional<sync::Patience> patience;
    std::uint64_t written = 0;
    bool is_reported = false;
    bool is_given_up = false;  // by the policy `go_on`, until the cause is gone

    bool is_idle() const { return !patience && !is_reported && !is_given_up; }
  };

  bool passes(Wait& wait, const std::string& cause, std::uint64_t step, sync::Time now);
  void attend_in_real_time(const std::string& blocking, std::uint64_t step, sync::Time now);

  const config::Sync sync_;
  RunReport& report_;
  std::int64_t window_ = kRecorderWindow;
  std::uint64_t limit_ = 0;  // the first step that a recorder is not ready for
  std::uint64_t written_ = 0;
  Wait full_, behind_;
};

}  // namespace sls::sim
