/// A control law: a pure function of measurement, reference and memory that returns a force.
/// A new law needs a folder beside this file and a line in laws.def: README.md, "Adding a law". No
/// DDS here.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "common/config/scenario.hpp"
#include "common/model/answer.hpp"
#include "common/model/math.hpp"
#include "common/model/measurement.hpp"
#include "common/model/reference.hpp"
#include "common/model/shared_load.hpp"

namespace sls::control {

using model::ErrorCode;
using model::MissionPhase;

/// A law is singular where s = g − n₃ vanishes; below this fraction of g it reports kFreeFall.
inline constexpr double kMinSupportFraction = 1e-3;

/// It is singular where the rod is level; below this cos α or cos β (0.06° from level) it reports
/// kRodLevel. It does the same with the load above the quadrotor, where a cosine is negative.
inline constexpr double kMinRodCosine = 1e-3;

/// True where a law reports kRodLevel.
inline bool is_level(const model::RodAngles& rod) {
  // Near the vertical, where rods usually are, no cosine is needed.
  const auto has_small_cosine = [](double angle) {
    return std::abs(angle) > 1.0 && math::cos(angle) < kMinRodCosine;
  };
  return has_small_cosine(rod.alpha) || has_small_cosine(rod.beta);
}

/// All inputs of a law.
struct LawInput {
  model::Measurement state;  ///< rod angles as wired to the controller's slots
  model::Reference reference;
  model::Numbers memory;  ///< as returned by the law for the previous step; zeros at step 0

  std::uint64_t step = 0;
  std::uint32_t stage = 0;  ///< stage of the mission, to which `reference` belongs
  double stage_time = 0.0;  ///< s since the stage began

  /// The references of the load where several vehicles carry one; else `reference` and level.
  model::Reference load_reference;
  model::AttitudeReference load_attitude;
};

struct LawOutput {
  Eigen::Vector3d f_Q_W = Eigen::Vector3d::Zero();  ///< N; zero with an error code
  model::Numbers memory;                            ///< for step + 1; `memory_size()` numbers
  ErrorCode error_code = ErrorCode::kNone;
};

/// The output of a law that gives no force, because of `error_code`.
template <class Output>
Output without_force(Output output, ErrorCode error_code) {
  output.f_Q_W.setZero();
  output.error_code = error_code;
  return output;
}

/// A law has no state that changes: its memory travels in `memory`, so any client can answer any
/// sample.
class ControlLaw {
 public:
  virtual ~ControlLaw() = default;
  /// @throws std::runtime_error if the law is broken, which ends the client.
  virtual LawOutput calc(const LawInput& input) const = 0;
  /// Number of memory numbers, at most `model::kMaxNumbers`.
  virtual int memory_size() const { return 0; }
};

/// The inputs from which a law is made.
struct LawSetup {
  config::Controller controller;
  double period = 0.0;                           ///< control period in force, s
  std::uint32_t vehicle_id = 0;                  ///< the vehicle that the law flies
  std::filesystem::path folder;                  ///< of the scenario file
  std::optional<model::SharedLoad> shared_load;  ///< of plants whose vehicles carry one together
};

/// Makes the law of a vehicle.
using LawMaker = std::function<std::unique_ptr<const ControlLaw>(const LawSetup&)>;

/// The law that `controller.law` names.
/// @throws config::ConfigError for gains without a solution, or a library that cannot be used.
std::unique_ptr<const ControlLaw> make_control_law(const LawSetup& setup);

}  // namespace sls::control
