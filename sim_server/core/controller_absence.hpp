/// Policy for a vehicle without a controller: `sync.wait.controller`.
/// Reads no clock: the caller passes the times. Rules: sim_server/README.md, "Waiting".
#pragma once

#include <cstdint>

#include "common/config/scenario.hpp"

namespace sls::sim {

class ControllerAbsence {
 public:
  explicit ControllerAbsence(const config::Sync& sync);

  enum class Action {
    kWait,      ///< wait for the answer
    kHold,      ///< fly this step with the last answer
    kFailSafe,  ///< fly this step with the fail-safe force
    kGiveUp,    ///< end the run as failed
  };

  /// Reaction to a step that has waited `step_wait_s` (wall time) for its answer. The first
  /// unanswered step was published `absence_s` ago. In real time the call comes when the step's
  /// period is over, and the result is never kWait.
  Action decide(double step_wait_s, double absence_s) const;

  /// A step was flown without an answer to it.
  void flown_without_answer() { ++steps_without_answer_; }
  /// An answer was accepted or, in real time, a late one came that is newer than those before.
  void answered() { steps_without_answer_ = 0; }

  /// True if the last step was flown without an answer, and none has come since.
  bool is_acting() const { return steps_without_answer_ > 0; }

  /// Absence after which decide() returns kGiveUp, s.
  double give_up_s() const;

 private:
  const config::Sync sync_;
  const double period_wall_s_;
  std::uint64_t steps_without_answer_ = 0;
};

}  // namespace sls::sim
