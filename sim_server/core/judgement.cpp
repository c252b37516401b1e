#include "sim_server/core/judgement.hpp"

#include <spdlog/fmt/fmt.h>

#include <cmath>
#include <variant>

namespace sls::sim {
namespace {

double calc_norm(const Eigen::Vector3d& f) { return std::hypot(f.x(), f.y(), f.z()); }

/// Least duration of a stage, ns.
std::int64_t find_least_duration(const config::LeaveCondition& leave) {
  const auto* timed = std::get_if<config::LeaveAfter>(&leave);
  return timed ? timed->duration_ns : std::get<config::LeaveWithin>(leave).after_ns;
}

}  // namespace

AnswerLimits make_answer_limits(const config::Scenario& scenario) {
  AnswerLimits limits;
  limits.force = scenario.controller.force_limit_n;
  limits.stages = static_cast<std::uint32_t>(scenario.mission.size());
  const std::int64_t period = scenario.sync.period_ns;
  for (const config::Stage& stage : scenario.mission) {
    const std::int64_t least = find_least_duration(stage.leave);
    // A stage ends at a step: at the first one that is not before its least duration.
    limits.earliest_end += static_cast<std::uint64_t>(least / period + (least % period != 0));
  }
  return limits;
}

std::optional<Defect> find_defect(const JudgedAnswer& answer, const AnswerLimits& limits) {
  if (!answer.f_Q_W.allFinite() || !answer.is_memory_finite) return Defect::kNotFinite;
  if (calc_norm(answer.f_Q_W) > limits.force) return Defect::kForceLimit;
  if (answer.undefined) return Defect::kUndefined;
  if (answer.fault || answer.is_mission_failed) return Defect::kFault;
  if (!answer.is_reference_finite) return Defect::kNotFinite;  // its fault would say why
  if (answer.stage > limits.stages) return Defect::kUnknownStage;
  const bool is_over = answer.is_mission_finished || answer.stage == limits.stages;
  if (is_over && answer.step < limits.earliest_end) return Defect::kEarlyEnd;
  return std::nullopt;
}

const char* to_string(Defect defect) {
  switch (defect) {
    case Defect::kNotFinite:
      return "a number that is not finite";
    case Defect::kForceLimit:
      return "a force beyond controller.force_limit_n";
    case Defect::kUndefined:
      return "an undefined value";
    case Defect::kFault:
      return "a fault";
    case Defect::kUnknownStage:
      return "a stage beyond its mission";
    case Defect::kEarlyEnd:
      return "an early end of its mission";
  }
  return "";
}

std::string describe_refusal(Defect defect, const JudgedAnswer& answer, const AnswerLimits& limits,
                             const std::string& controller) {
  const std::string text = fmt::format("controller '{}' answered step {} with {}", controller,
                                       answer.step, to_string(defect));
  switch (defect) {
    case Defect::kNotFinite:
      if (!answer.f_Q_W.allFinite()) return text;
      return text + (answer.is_memory_finite ? " in reference" : " in controller.numbers");
    case Defect::kForceLimit:
      return text + fmt::format(": {:.6g} N > {:.6g} N", calc_norm(answer.f_Q_W), limits.force);
    case Defect::kUndefined:
      return text + fmt::format(": {} {}", answer.undefined->field, answer.undefined->value);
    case Defect::kFault:
      return text + fmt::format(": {}", answer.fault ? answer.fault : "mission failed");
    case Defect::kUnknownStage:
      return text + fmt::format(": stage_index {} > {}", answer.stage, limits.stages);
    case Defect::kEarlyEnd:
      return text + fmt::format(": expected at step {} or later", limits.earliest_end);
  }
  return text;
}

}  // namespace sls::sim
