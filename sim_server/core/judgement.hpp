/// Checks an answer, for server and closed loop. No DDS and no Simbody here.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>

#include "common/config/scenario.hpp"

namespace sls::sim {

enum class Defect {
  kNotFinite,     ///< a number of force, memory or reference is not finite
  kForceLimit,    ///< |F| beyond `controller.force_limit_n`
  kUndefined,     ///< an enumerator that the contract does not define
  kFault,         ///< an error code, or a failed mission
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

/// The checked parts of an answer.
struct JudgedAnswer {
  /// A field of the answer whose value is not defined.
  struct Undefined {
    const char* field;
    std::uint32_t value;
  };

  std::uint64_t step = 0;
  Eigen::Vector3d f_Q_W = Eigen::Vector3d::Zero();  ///< N
  bool is_memory_finite = true;
  bool is_reference_finite = true;
  std::optional<Undefined> undefined;
  const char* fault = nullptr;  ///< name of its error code; null: none
  bool is_mission_failed = false;
  bool is_mission_finished = false;
  std::uint32_t stage = 0;  ///< for the next step; the number of stages once all are over
};

/// The reason to refuse `answer`; nothing if it is valid.
std::optional<Defect> find_defect(const JudgedAnswer& answer, const AnswerLimits& limits);

/// "a number that is not finite", "a force beyond controller.force_limit_n", "a fault" …
const char* to_string(Defect defect);

/// `controller 'NAME' answered step N with …`, with the place of the number if it is not in the
/// force, the value and the limit, or the error code.
std::string describe_refusal(Defect defect, const JudgedAnswer& answer, const AnswerLimits& limits,
                             const std::string& controller);

}  // namespace sls::sim
