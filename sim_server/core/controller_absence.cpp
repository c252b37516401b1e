#include "sim_server/core/controller_absence.hpp"

namespace sls::sim {
namespace {

using config::ControllerPolicy;

}  // namespace

ControllerAbsence::ControllerAbsence(const config::Sync& sync)
    : sync_(sync),
      period_wall_s_(static_cast<double>(sync.period_ns) * 1e-9 / sync.real_time_factor) {}

double ControllerAbsence::give_up_s() const { return sync_.calc_controller_patience_s(); }

ControllerAbsence::Action ControllerAbsence::decide(double step_wait_s, double absence_s) const {
  if (absence_s >= give_up_s()) return Action::kGiveUp;
  const auto& absence = sync_.wait.controller;
  const bool is_realtime = sync_.mode == config::SyncMode::kRealtime;
  if (!is_realtime) {
    if (absence.policy == ControllerPolicy::kWait || absence.policy == ControllerPolicy::kStop)
      return Action::kWait;
    // The first step waits for the deadline, each later one for one period. Simulated time then
    // passes no faster than in real time, so a client can return.
    if (step_wait_s < (is_acting() ? period_wall_s_ : absence.deadline_s)) return Action::kWait;
    if (absence.policy == ControllerPolicy::kFailsafe) return Action::kFailSafe;
  }
  const double held_s = static_cast<double>(steps_without_answer_) * sync_.period_ns * 1e-9;
  return held_s < sync_.max_hold_s ? Action::kHold : Action::kFailSafe;
}

}  // namespace sls::sim
