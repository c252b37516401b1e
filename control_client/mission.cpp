#include "control_client/mission.hpp"

#include <algorithm>
#include <limits>

namespace sls::control {
namespace {

enum class StageOutcome { kGoesOn, kLeft, kTimedOut };

/// The values that the conditions of a stage compare.
struct Seen {
  const model::Measurement& state;
  const model::Reference& reference;
  const std::optional<CableEnd>& end;

  /// A signal of the plant; NaN, with which no comparison holds, if the sample lacks it.
  double signal(Eigen::Index place) const {
    return place < state.signals.size() ? state.signals[place]
                                        : std::numeric_limits<double>::quiet_NaN();
  }
};

bool holds(const config::LeaveUntil& leave, const Seen& seen) {
  using Condition = config::LeaveUntil::Condition;
  using Signal = model::SharedLoad::Signal;
  switch (leave.condition) {
    case Condition::kWithin: {
      const bool is_load = leave.body == config::Body::kLoad;
      const Eigen::Vector3d& body = is_load ? seen.state.p_WL : seen.state.p_WQ;
      const Eigen::Vector3d target = seen.reference.position + leave.offset;
      return (body - target).norm() < leave.radius_m;
    }
    case Condition::kCable:
      return seen.signal(Signal::kTaut) == (leave.cable == config::CableState::kTaut ? 1.0 : 0.0);
    case Condition::kLoad:
      return seen.signal(seen.end.value().on_ground.value()) ==
             (leave.load == config::LoadPlace::kOnGround ? 1.0 : 0.0);
    case Condition::kTensionAbove:
      return seen.signal(Signal::kTension) > leave.tension_n;
    case Condition::kTensionBelow:
      return seen.signal(Signal::kTension) < leave.tension_n;
  }
  return false;
}

StageOutcome judge(const config::LeaveAfter& leave, std::int64_t elapsed_ns, const Seen&) {
  return elapsed_ns >= leave.duration_ns ? StageOutcome::kLeft : StageOutcome::kGoesOn;
}

StageOutcome judge(const config::LeaveUntil& leave, std::int64_t elapsed_ns, const Seen& seen) {
  if (elapsed_ns > leave.after_ns && holds(leave, seen)) return StageOutcome::kLeft;
  return elapsed_ns >= leave.timeout_ns ? StageOutcome::kTimedOut : StageOutcome::kGoesOn;
}

double to_seconds(std::int64_t nanoseconds) { return static_cast<double>(nanoseconds) / 1e9; }

}  // namespace

std::optional<CableEnd> find_cable_end(const config::Scenario& scenario, std::uint32_t vehicle_id) {
  if (!scenario.shared_load) return {};
  const model::SharedLoad& load = *scenario.shared_load;
  return CableEnd{load.q_WL, load.cables.at(vehicle_id).attachment_L, load.on_ground};
}

Mission::Mission(const std::vector<config::Stage>& stages, std::int64_t period_ns,
                 const std::optional<CableEnd>& end)
    : period_ns_(period_ns), end_(end) {
  if (stages.empty()) throw config::ConfigError("mission: expected at least one stage, got none");
  if (period_ns <= 0) {
    throw config::ConfigError("sync.period_s: expected > 0, got " + std::to_string(period_ns) +
                              " ns");
  }
  for (const config::Stage& stage : stages) {
    stages_.push_back({stage.name, make_reference_trajectory(stage.reference), {}, stage.leave});
    if (end) stages_.back().attitude.emplace(stage.reference, end->q_WL);
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

void Mission::calc_reference(const Stage& stage, double time, MissionProgress& progress) const {
  progress.reference = progress.load_reference = stage.trajectory->calc(time);
  if (!stage.attitude) return;
  progress.load_attitude = stage.attitude->calc(time);
  progress.load_reference.position -= end_->q_WL.toRotationMatrix() * end_->attachment_L;
  if (stage.attitude->turns())  // else the end is where the stage has it, to the last bit
    progress.reference =
        calc_end_reference(progress.load_reference, progress.load_attitude, end_->attachment_L);
}

model::Reference Mission::calc_reference(std::uint32_t stage, double time) const {
  MissionProgress progress;
  calc_reference(stages_[stage], time, progress);
  return progress.reference;
}

MissionProgress Mission::calc_progress(std::uint64_t step, const model::Measurement& state,
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
    calc_reference(stage, to_seconds(elapsed_ns), progress);
    StageOutcome outcome = StageOutcome::kLeft;  // a finished mission stays finished
    if (memory.stage < end)
      outcome = std::visit(
          [&](const auto& leave) {
            return judge(leave, elapsed_ns, {state, progress.reference, end_});
          },
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
