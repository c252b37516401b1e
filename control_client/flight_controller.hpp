/// One answer to one state sample: mission, control law and integrals together. No DDS here.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <string>

#include "common/config/scenario.hpp"
#include "common/model/answer.hpp"
#include "common/model/measurement.hpp"
#include "common/model/reference.hpp"
#include "control_client/laws/control_law.hpp"

namespace sls::control {

/// The memory of a controller. It travels in the command and comes back in the next state, so any
/// client can answer any sample. A run starts with the default, which means zeros.
struct ControllerMemory {
  std::uint32_t stage = 0;             ///< index into the mission; its size once it is over
  std::uint64_t stage_start_step = 0;  ///< step at which that stage began
  model::Numbers numbers;              ///< those of the law; none at the start of a run
};

using model::Fault;
using model::MissionPhase;

/// A pure function's result: equal inputs give equal bits.
struct Answer {
  Eigen::Vector3d f_Q_W = Eigen::Vector3d::Zero();  ///< N; zero with a fault
  ControllerMemory memory;                          ///< for step + 1
  MissionPhase mission = MissionPhase::kRunning;
  Fault fault = Fault::kNone;
  model::Reference reference;  ///< of this step
  std::uint32_t stage = 0;     ///< stage in force at this step
  std::string stage_name;
};

class FlightController {
 public:
  /// Copies what it needs of `scenario`, whose period is the one in force. In the first 100 steps,
  /// or in all if `checks_purity`, every answer is computed twice: a law that keeps a state between
  /// calls is refused.
  /// @throws config::ConfigError if the LQR weights or the law have no solution.
  explicit FlightController(const config::Scenario& scenario, std::uint32_t vehicle_id = 0,
                            bool checks_purity = false,
                            const LawMaker& make_law = &make_control_law);
  ~FlightController();
  FlightController(FlightController&&) noexcept;

  /// Answer to the state of step `step`, given the memory accepted at step − 1.
  /// @throws std::runtime_error if a law of a shared library is broken.
  Answer calc_answer(std::uint64_t step, const model::Measurement& state,
                     const ControllerMemory& memory) const;

  /// Number of memory numbers of the law.
  int memory_size() const;

 private:
  struct Parts;
  std::unique_ptr<const Parts> parts_;
};

}  // namespace sls::control
