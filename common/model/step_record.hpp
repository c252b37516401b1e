/// One step of one vehicle, as recordings hold it.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <string>

#include "common/model/answer.hpp"
#include "common/model/measurement.hpp"

namespace sls::model {

/// Which answer is in force over [k, k + 1). Each enumerator has the number that it has in
/// idl/sls.idl.
enum class AnswerKind : std::uint32_t {
  kNone,      ///< no answer: the run ended with the state of step k
  kAccepted,  ///< the answer to step k
  kHeld,      ///< an older answer, held because none came in time
  kFailSafe,  ///< the server's force, with the controller memory of an older answer
  kRefused,   ///< the refused answer to step k; it is not in force, and the run failed
  kLate,      ///< an extra record without a state: an answer to step k that came after the step
};

struct StepRecord {
  /// The motion that controllers answer.
  const Measurement& seen() const { return measured ? *measured : truth; }

  std::uint32_t vehicle_id = 0;
  std::uint64_t step = 0;  ///< k
  AnswerKind kind = AnswerKind::kNone;
  Measurement truth;                    ///< true state at k
  std::optional<Measurement> measured;  ///< measured state at k, if it can differ from the truth
  Eigen::Vector3d f_Q_W = Eigen::Vector3d::Zero();  ///< acted over [k − 1, k), after faults, N
  std::uint64_t answered_step = 0;                  ///< step of the state that `answer` is for
  std::string client_name;                          ///< client that sent the answer
  Answer answer;                                    ///< as the client sent it, before faults
};

}  // namespace sls::model
