#include "control_client/flight_controller.hpp"

#include "control_client/control_law.hpp"
#include "control_client/drag_feed_forward.hpp"
#include "control_client/error_integral.hpp"
#include "control_client/mission.hpp"
#include "control_client/saturation.hpp"
#include "control_client/state_wiring.hpp"

namespace sls::control {

const char* to_string(Fault fault) {
  switch (fault) {
    case Fault::kNone:
      return "none";
    case Fault::kFreeFall:
      return "free_fall";
    case Fault::kRodLevel:
      return "rod_level";
    case Fault::kNotFinite:
      return "not_finite";
    case Fault::kStageTimeout:
      return "stage_timeout";
  }
  return "unknown";
}

struct FlightController::Parts {
  explicit Parts(const config::Scenario& scenario)
      : controller(scenario.controller),
        plant_rod_length(scenario.vehicle.rod_length),
        period(static_cast<double>(scenario.sync.period_ns) / 1e9),
        mission(scenario.mission, scenario.sync.period_ns),
        law(make_control_law(scenario.controller)) {}

  /// Force and integral for an answer whose reference is known.
  void fly(const model::SlungLoadState& state, const Eigen::Vector3d& integral,
           Answer& answer) const;

  config::Controller controller;
  double plant_rod_length;  ///< the truth, which only the gazebo wiring looks at
  double period;            ///< s
  Mission mission;
  std::unique_ptr<const ControlLaw> law;
};

namespace {

void fail(Answer& answer, Fault fault) {
  answer.f_Q_W.setZero();
  answer.mission = MissionPhase::kFailed;
  answer.fault = fault;
}

}  // namespace

void FlightController::Parts::fly(const model::SlungLoadState& state,
                                  const Eigen::Vector3d& integral, Answer& answer) const {
  LawInput input;
  input.p_WQ = state.p_WQ;
  input.v_WQ = state.v_WQ;
  input.rod = calc_wired_angles(state.rod, controller.state_wiring, plant_rod_length);
  input.reference = answer.reference;
  input.integral = integral;

  const LawOutput output = law->calc(input);
  if (output.fault != Fault::kNone) return fail(answer, output.fault);
  answer.f_Q_W = output.f_Q_W;
  if (controller.drag_feed_forward) {
    answer.f_Q_W = calc_drag_feed_forward(answer.f_Q_W, state.v_WQ, controller.model.air);
  }
  if (controller.saturate) answer.f_Q_W = calc_saturated(answer.f_Q_W, controller.force_limit_n);
  if (!answer.f_Q_W.allFinite()) return fail(answer, Fault::kNotFinite);
  answer.memory.integral = calc_next_integral(integral, output.integral_rate, period);
}

FlightController::FlightController(const config::Scenario& scenario)
    : parts_(std::make_unique<const Parts>(scenario)) {}

FlightController::~FlightController() = default;

Answer FlightController::calc_answer(std::uint64_t step, const model::SlungLoadState& state,
                                     const ControllerMemory& memory) const {
  Answer answer;
  answer.memory = memory;
  answer.stage = memory.stage;
  if (!parts_->mission.is_possible(step, memory)) {
    fail(answer, Fault::kNotFinite);  // a damaged sample: there is no stage to fly
    return answer;
  }

  const MissionProgress progress = parts_->mission.calc_progress(step, state, memory);
  answer.memory.stage = progress.remembered_stage;
  answer.memory.stage_start_step = progress.stage_start_step;
  answer.mission = progress.phase;
  answer.reference = progress.reference;
  answer.stage = progress.stage;
  answer.stage_name = parts_->mission.stage_name(progress.stage);

  if (!model::is_finite(state) || !memory.integral.allFinite()) {
    fail(answer, Fault::kNotFinite);
  } else if (progress.phase == MissionPhase::kFailed) {
    fail(answer, Fault::kStageTimeout);
  } else {
    parts_->fly(state, memory.integral, answer);
  }
  return answer;
}

}  // namespace sls::control
