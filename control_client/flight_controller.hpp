/// One answer to one state sample: mission, control law and integrals together. No DDS here.
#pragma once

#include <cstdint>
#include <memory>

#include "common/config/scenario.hpp"
#include "common/model/answer.hpp"
#include "common/model/measurement.hpp"
#include "control_client/laws/control_law.hpp"

namespace sls::control {

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

  /// Answer to the state of step `step`, given the memory accepted at step − 1. The compute time is
  /// left to the caller.
  /// @throws std::runtime_error if a law of a shared library is broken.
  model::Answer calc_answer(std::uint64_t step, const model::Measurement& state,
                            const model::ControllerMemory& memory) const;

  /// Number of memory numbers of the law.
  int memory_size() const;

 private:
  struct Parts;
  std::unique_ptr<const Parts> parts_;
};

}  // namespace sls::control
