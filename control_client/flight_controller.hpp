/// One answer to one state sample: mission, control law and integrals together. No DDS here.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <string>

#include "common/config/scenario.hpp"
#include "common/model/reference.hpp"
#include "common/model/state.hpp"

namespace sls::control {

/// All that a controller remembers. It travels in the command and comes back in the next state, so
/// that any client can answer any sample. A run starts with the default.
struct ControllerMemory {
  std::uint32_t stage = 0;             ///< index into the mission; its size once it is over
  std::uint64_t stage_start_step = 0;  ///< step at which that stage began
  Eigen::Vector3d integral = Eigen::Vector3d::Zero();  ///< ∫e dt of the load position, m·s
};

enum class MissionPhase { kRunning, kFinished, kFailed };

enum class Fault {
  kNone,
  kFreeFall,      ///< s → 0: the law asks the load to fall freely
  kRodLevel,      ///< cos α → 0 or cos β → 0
  kNotFinite,     ///< the state or the computed force is not finite
  kStageTimeout,  ///< a stage's radius was not reached in time
};

/// For logs and files: "none", "free_fall", "rod_level", "not_finite", "stage_timeout".
const char* to_string(Fault fault);

/// A pure function's result: equal inputs give equal bits.
struct Answer {
  Eigen::Vector3d f_Q_W = Eigen::Vector3d::Zero();  ///< N; zero with a fault
  ControllerMemory memory;                          ///< to be used at step + 1
  MissionPhase mission = MissionPhase::kRunning;
  Fault fault = Fault::kNone;
  model::Reference reference;  ///< what the force follows
  std::uint32_t stage = 0;     ///< stage in force at this step
  std::string stage_name;
};

class FlightController {
 public:
  /// Keeps what it needs of `scenario`; its period is the one in force.
  /// @throws config::ConfigError if the LQR weights or the law have no solution.
  explicit FlightController(const config::Scenario& scenario);
  ~FlightController();

  /// Answer to the state of step `step`, given the memory accepted at step − 1.
  Answer calc_answer(std::uint64_t step, const model::SlungLoadState& state,
                     const ControllerMemory& memory) const;

 private:
  struct Parts;
  std::unique_ptr<const Parts> parts_;
};

}  // namespace sls::control
