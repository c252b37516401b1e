/// Checks an answer, for server and closed loop. No DDS and no Simbody here.
#pragma once

#include <cstdint>
#include <limits>
#include <optional>
#include <string>

#include "common/config/scenario.hpp"
#include "common/model/answer.hpp"

namespace sls::sim {

enum class Defect {
  kNotFinite,     ///< a number of force, memory or reference is not finite
  kForceLimit,    ///< |F| beyond `controller.force_limit_n`
  kUndefined,     ///< an enumerator that the contract does not define
  kErrorCode,     ///< an error code, or a failed mission
  kUnknownStage,  ///< a stage beyond the mission
  kEarlyEnd,      ///< the mission is over before its stages can be
};

/// The limits of a vehicle's answers.
struct AnswerLimits {
  double force = 0.0;                                                ///< N
  std::uint32_t stages = std::numeric_limits<std::uint32_t>::max();  ///< of the mission
  std::uint64_t earliest_end = 0;  ///< first step at which the mission can be over
};

/// The limits of a scenario with the period in force.
AnswerLimits make_answer_limits(const config::Scenario& scenario);

/// The reason to refuse `answer` to the state of `step`; nothing if it is valid.
std::optional<Defect> find_defect(std::uint64_t step, const model::Answer& answer,
                                  const AnswerLimits& limits);

/// "a number that is not finite", "a force beyond controller.force_limit_n", "a fault" …
const char* to_string(Defect defect);

/// `controller 'NAME' answered step N with …`, with the place of the number if it is not in the
/// force, the value and the limit, or the error code.
std::string describe_refusal(Defect defect, std::uint64_t step, const model::Answer& answer,
                             const AnswerLimits& limits, const std::string& controller);

}  // namespace sls::sim
