/// Mission progress and error code in a controller's answer.
#pragma once

namespace sls::model {

enum class MissionPhase { kRunning, kFinished, kFailed };

/// Error code of a controller. With any code except kNone the force is zero and the mission has
/// failed.
enum class Fault {
  kNone,
  kFreeFall,      ///< s → 0: the law asks the load to fall freely
  kRodLevel,      ///< cos α → 0 or cos β → 0
  kNotFinite,     ///< the state or the computed force is not finite
  kStageTimeout,  ///< a stage's radius was not reached in time
};

/// For logs and files: "none", "free_fall", "rod_level", "not_finite", "stage_timeout".
const char* to_string(Fault fault);

}  // namespace sls::model
