#include "sim_server/core/answers/judgement.hpp"

#include <spdlog/fmt/fmt.h>

#include <cmath>
#include <utility>

namespace sls::sim {
namespace {

using model::ErrorCode;
using model::MissionPhase;

double calc_norm(const Eigen::Vector3d& f) { return std::hypot(f.x(), f.y(), f.z()); }

/// True if no number is infinite or NaN: the product of such a number with zero is NaN.
bool is_finite(const model::Reference& reference) {
  double sum = 0.0;
  for (const Eigen::Vector3d* vector : {&reference.position, &reference.velocity,
                                        &reference.acceleration, &reference.jerk, &reference.snap})
    for (const double x : *vector) sum += 0.0 * x;
  return sum == 0.0;
}

/// The first enumerator that the contract does not define, by its field; null: there is none.
std::pair<const char*, std::uint32_t> find_undefined(const model::Answer& answer) {
  const auto mission = static_cast<std::uint32_t>(answer.mission);
  const auto fault = static_cast<std::uint32_t>(answer.error_code);
  if (mission > static_cast<std::uint32_t>(MissionPhase::kFailed)) return {"mission", mission};
  if (fault > static_cast<std::uint32_t>(ErrorCode::kStageTimeout)) return {"fault", fault};
  return {nullptr, 0};
}

}  // namespace

AnswerLimits make_answer_limits(const config::Scenario& scenario) {
  AnswerLimits limits;
  limits.force = scenario.controller.force_limit_n;
  limits.stages = static_cast<std::uint32_t>(scenario.mission.size());
  const std::int64_t period = scenario.sync.period_ns;
  for (const config::Stage& stage : scenario.mission) {
    const std::int64_t least = config::find_least_duration_ns(stage.leave);
    // A stage ends at a step: at the first one that is not before its least duration.
    limits.earliest_end += static_cast<std::uint64_t>(least / period + (least % period != 0));
  }
  return limits;
}

std::optional<Defect> find_defect(std::uint64_t step, const model::Answer& answer,
                                  const AnswerLimits& limits) {
  if (!answer.f_Q_W.allFinite() || !answer.memory.numbers.allFinite()) return Defect::kNotFinite;
  if (calc_norm(answer.f_Q_W) > limits.force) return Defect::kForceLimit;
  if (find_undefined(answer).first) return Defect::kUndefined;
  if (answer.error_code != ErrorCode::kNone || answer.mission == MissionPhase::kFailed)
    return Defect::kErrorCode;
  if (!is_finite(answer.reference)) return Defect::kNotFinite;  // its error code would say why
  const std::uint32_t stage = answer.memory.stage;
  if (stage > limits.stages) return Defect::kUnknownStage;
  const bool is_over = answer.mission == MissionPhase::kFinished || stage == limits.stages;
  if (is_over && step < limits.earliest_end) return Defect::kEarlyEnd;
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
    case Defect::kErrorCode:
      return "a fault";
    case Defect::kUnknownStage:
      return "a stage beyond its mission";
    case Defect::kEarlyEnd:
      return "an early end of its mission";
  }
  return "";
}

std::string describe_refusal(Defect defect, std::uint64_t step, const model::Answer& answer,
                             const AnswerLimits& limits, const std::string& controller) {
  const std::string text =
      fmt::format("controller '{}' answered step {} with {}", controller, step, to_string(defect));
  switch (defect) {
    case Defect::kNotFinite:
      if (!answer.f_Q_W.allFinite()) return text;
      return text +
             (answer.memory.numbers.allFinite() ? " in reference" : " in controller.numbers");
    case Defect::kForceLimit:
      return text + fmt::format(": {:.6g} N > {:.6g} N", calc_norm(answer.f_Q_W), limits.force);
    case Defect::kUndefined: {
      const auto [field, value] = find_undefined(answer);
      return text + fmt::format(": {} {}", field, value);
    }
    case Defect::kErrorCode:
      return text + fmt::format(": {}", answer.error_code != ErrorCode::kNone
                                            ? to_string(answer.error_code)
                                            : "mission failed");
    case Defect::kUnknownStage:
      return text + fmt::format(": stage_index {} > {}", answer.memory.stage, limits.stages);
    case Defect::kEarlyEnd:
      return text + fmt::format(": expected at step {} or later", limits.earliest_end);
  }
  return text;
}

}  // namespace sls::sim
