#include "control_client/mission.hpp"

#include <algorithm>
#include <limits>

namespace sls::control {
namespace {

enum class StageOutcome { kGoesOn, kLeft, kTimedOut };

StageOutcome judge(const config::LeaveAfter& leave, std::int64_t elapsed_ns,
                   const model::SlungLoadState&, const model::Reference&) {
  return elapsed_ns >= leave.duration_ns ? StageOutcome::kLeft : StageOutcome::kGoesOn;
}

StageOutcome judge(const config::LeaveWithin& leave, std::int64_t elapsed_ns,
                   const model::SlungLoadState& state, const model::Reference& reference) {
  const Eigen::Vector3d& body = leave.body == config::Body::kLoad ? state.p_WL : state.p_WQ;
  const Eigen::Vector3d target = reference.position + leave.offset;
  if (elapsed_ns > leave.after_ns && (body - target).norm() < leave.radius_m) {
    return StageOutcome::kLeft;
  }
  return elapsed_ns >= leave.timeout_ns ? StageOutcome::kTimedOut : StageOutcome::kGoesOn;
}

double to_seconds(std::int64_t nanoseconds) { return static_cast<double>(nanoseconds) / 1e9; }

}  // namespace

Mission::Mission(const std::vector<config::Stage>& stages, std::int64_t period_ns)
    : period_ns_(period_ns) {
  if (stages.empty()) throw config::ConfigError("mission: expected at least one stage, got none");
  if (period_ns <= 0) {
    throw config::ConfigError("sync.period_s: expected > 0, got " + std::to_string(period_ns) +
                              " ns");
  }
  for (const config::Stage& stage : stages) {
    stages_.push_back({stage.name, make_reference_trajectory(stage.reference), stage.leave});
  }
}

bool Mission::is_possible(std::uint64_t step, const model::ControllerMemory& memory) const {
  return memory.stage <= stages_.size() && memory.stage_start_step <= step;
}

std::int64_t Mission::calc_elapsed_ns(std::uint64_t step, std::uint64_t start_step) const {
  constexpr std::int64_t kLargest = std::numeric_limits<std::int64_t>::max();
  const std::uint64_t steps = step - start_step;
  if (steps > static_cast<std::uint64_t>(kLargest / period_ns_)) return kLargest;
  return static_cast<std::int64_t>(steps) * period_ns_;
}

MissionProgress Mission::calc_progress(std::uint64_t step, const model::SlungLoadState& state,
                                       const model::ControllerMemory& memory) const {
  const auto end = static_cast<std::uint32_t>(stages_.size());
  MissionProgress progress;
  progress.stage = std::min(memory.stage, end - 1);
  progress.remembered_stage = memory.stage;
  progress.stage_start_step = memory.stage_start_step;
  // A loop, because a stage without duration ends at the step at which it began; once per stage at
  // most.
  while (true) {
    const Stage& stage = stages_[progress.stage];
    const std::int64_t elapsed_ns = calc_elapsed_ns(step, progress.stage_start_step);
    progress.reference = stage.trajectory->calc(to_seconds(elapsed_ns));
    StageOutcome outcome = StageOutcome::kLeft;  // a finished mission stays finished
    if (memory.stage < end)
      outcome = std::visit(
          [&](const auto& leave) { return judge(leave, elapsed_ns, state, progress.reference); },
          stage.leave);
    if (outcome == StageOutcome::kGoesOn) return progress;
    if (outcome == StageOutcome::kTimedOut) {
      progress.phase = model::MissionPhase::kFailed;
      return progress;
    }
    if (progress.stage + 1 == end) {
      progress.phase = model::MissionPhase::kFinished;
      progress.remembered_stage = end;
      return progress;
    }
    progress.remembered_stage = ++progress.stage;
    progress.stage_start_step = step;
  }
}

}  // namespace sls::control
