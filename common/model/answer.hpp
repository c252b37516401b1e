/// The answer of a controller to one state.
#pragma once

#include <Eigen/Core>
#include <chrono>
#include <cstdint>
#include <string>

#include "common/model/measurement.hpp"
#include "common/model/reference.hpp"

namespace sls::model {

// Each enumerator has the number that it has in idl/sls.idl. An answer from the network can hold
// any other number, too.

enum class MissionPhase : std::uint32_t { kRunning, kFinished, kFailed };

/// Error code of a controller. With any code except kNone the force is zero and the mission has
/// failed.
enum class ErrorCode : std::uint32_t {
  kNone,
  kFreeFall,      ///< s → 0: the law asks the load to fall freely
  kRodLevel,      ///< cos α → 0 or cos β → 0
  kNotFinite,     ///< the state or the computed force is not finite
  kStageTimeout,  ///< a stage's radius was not reached in time
};

/// For logs and files: "none", "free_fall", "rod_level", "not_finite", "stage_timeout"; "unknown"
/// for any other number.
inline const char* to_string(ErrorCode error_code) {
  switch (error_code) {
    case ErrorCode::kNone:
      return "none";
    case ErrorCode::kFreeFall:
      return "free_fall";
    case ErrorCode::kRodLevel:
      return "rod_level";
    case ErrorCode::kNotFinite:
      return "not_finite";
    case ErrorCode::kStageTimeout:
      return "stage_timeout";
  }
  return "unknown";
}

/// The memory of a controller. It travels in the command and comes back in the next state, so any
/// client can answer any sample. A run starts with the default, which means zeros.
struct ControllerMemory {
  std::uint32_t stage = 0;             ///< index into the mission; its size once it is over
  std::uint64_t stage_start_step = 0;  ///< step at which that stage began
  Numbers numbers;                     ///< those of the law; none at the start of a run
};

/// Equal states and memories give equal bits, except of the compute time.
struct Answer {
  Eigen::Vector3d f_Q_W = Eigen::Vector3d::Zero();  ///< N; zero with an error code
  ControllerMemory memory;                          ///< for step + 1
  MissionPhase mission = MissionPhase::kRunning;
  ErrorCode error_code = ErrorCode::kNone;
  Reference reference;      ///< of this step
  std::uint32_t stage = 0;  ///< stage in force at this step
  std::string stage_name;
  std::chrono::duration<std::uint64_t, std::nano> compute_time{0};  ///< wall time it took
};

}  // namespace sls::model
