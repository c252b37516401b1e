/// Checks an answer, for server and closed loop. No DDS and no Simbody here.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>

namespace sls::sim {

enum class Defect {
  kNotFinite,   ///< a number of force or memory is not finite
  kForceLimit,  ///< |F| beyond `controller.force_limit_n`
  kFault,       ///< an error code, or a failed mission
};

/// The checked parts of an answer.
struct JudgedAnswer {
  Eigen::Vector3d f_Q_W = Eigen::Vector3d::Zero();  ///< N
  bool is_memory_finite = true;
  const char* fault = nullptr;  ///< name of its error code; null: none
  bool is_mission_failed = false;
};

/// The reason to refuse `answer`; nothing if it is valid.
std::optional<Defect> find_defect(const JudgedAnswer& answer, double force_limit);

/// "a number that is not finite", "a force beyond controller.force_limit_n", "a fault".
const char* to_string(Defect defect);

/// `controller 'NAME' answered step N with …`, with the force and the limit, or the error code.
std::string describe_refusal(Defect defect, const JudgedAnswer& answer, double force_limit,
                             const std::string& controller, std::uint64_t step);

}  // namespace sls::sim
