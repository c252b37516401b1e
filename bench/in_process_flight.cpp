#include "bench/in_process_flight.hpp"

#include <cmath>
#include <exception>
#include <utility>

#include "common/config/numbers.hpp"

namespace sls::bench {

InProcessFlight::InProcessFlight(const config::Scenario& scenario, std::uint32_t vehicle)
    : scenario_(config::make_vehicle_scenario(scenario, vehicle)),
      steps_per_period_(scenario_.sync.period_ns / scenario_.plant.step_ns),
      force_limit_(scenario_.controller.force_limit_n),
      plant_(scenario_.vehicle, scenario_.plant),
      faults_(scenario_, vehicle),
      controller_(scenario_) {}

std::optional<FlownStep> InProcessFlight::fly_step() {
  if (has_ended_) return std::nullopt;
  if (meant_f_Q_W_ && !apply(*meant_f_Q_W_)) {
    has_ended_ = true;
    return std::nullopt;
  }
  FlownStep flown;
  flown.step = step_;
  flown.truth = plant_.state();
  flown.measured = faults_.measure(step_, flown.truth);
  flown.applied_f_Q_W = applied_f_Q_W_;
  flown.answer = controller_.calc_answer(step_, flown.measured, memory_);
  has_ended_ = is_last(flown.answer);
  memory_ = flown.answer.memory;
  meant_f_Q_W_ = flown.answer.f_Q_W;
  return flown;
}

bool InProcessFlight::apply(const Eigen::Vector3d& f_Q_W) {
  applied_f_Q_W_ = faults_.actuate(step_, f_Q_W);
  ++step_;
  try {
    for (std::int64_t i = 0; i < steps_per_period_; ++i) plant_.step(applied_f_Q_W_);
  } catch (const std::exception& error) {
    failure_ = error.what();
    return false;
  }
  return true;
}

bool InProcessFlight::is_last(const control::Answer& answer) {
  const Eigen::Vector3d& force = answer.f_Q_W;
  const double magnitude = std::hypot(force.x(), force.y(), force.z());  // as the server has it
  if (magnitude > force_limit_)
    failure_ = "force beyond controller.force_limit_n (" + config::to_text(force_limit_) + ")";
  else if (answer.fault != control::Fault::kNone)
    failure_ = std::string("controller fault ") + control::to_string(answer.fault);
  return !failure_.empty() || answer.mission != control::MissionPhase::kRunning;
}

std::vector<FlownStep> fly(const config::Scenario& scenario, std::uint32_t vehicle) {
  InProcessFlight flight(scenario, vehicle);
  std::vector<FlownStep> steps;
  while (auto step = flight.fly_step()) steps.push_back(std::move(*step));
  return steps;
}

}  // namespace sls::bench
