#include "control_client/flight_controller.hpp"

#include <cstring>
#include <stdexcept>

#include "control_client/around_law.hpp"
#include "control_client/laws/control_law.hpp"
#include "control_client/mission.hpp"

namespace sls::control {

namespace {

constexpr std::uint64_t kPurityCheckedSteps = 100;

void fail(model::Answer& answer, ErrorCode error_code) {
  answer.f_Q_W.setZero();
  answer.mission = MissionPhase::kFailed;
  answer.error_code = error_code;
}

/// Compares bits: NaN differs from itself, but is no sign of an impure law.
bool are_equal(const double* a, const double* b, Eigen::Index count) {
  return std::memcmp(a, b, static_cast<std::size_t>(count) * sizeof(double)) == 0;
}

bool are_equal(const LawOutput& a, const LawOutput& b) {
  return a.error_code == b.error_code && a.memory.size() == b.memory.size() &&
         are_equal(a.f_Q_W.data(), b.f_Q_W.data(), 3) &&
         are_equal(a.memory.data(), b.memory.data(), a.memory.size());
}

}  // namespace

struct FlightController::Parts {
  Parts(const config::Scenario& scenario, std::uint32_t vehicle, bool checks_purity_always,
        const LawMaker& make_law)
      : controller(scenario.controller),
        vehicle_id(vehicle),
        plant_rod_length(scenario.vehicle.rod_length),
        period(static_cast<double>(scenario.sync.period_ns) / 1e9),
        mission(scenario.mission, scenario.sync.period_ns, find_cable_end(scenario, vehicle_id)),
        law(make_law(
            {scenario.controller, period, vehicle_id, scenario.folder, scenario.shared_load})),
        checks_purity(checks_purity_always) {
    if (law->memory_size() > model::kMaxNumbers)
      throw config::ConfigError(controller.law.describe_place("controller.law") +
                                ": expected at most " + std::to_string(model::kMaxNumbers) +
                                " memory numbers, which is what sls/command carries, got " +
                                std::to_string(law->memory_size()) + " of '" + controller.law.name +
                                "'");
  }

  /// Force and memory for an answer whose reference is known.
  void fly(std::uint64_t step, const model::Measurement& state, const model::Numbers& memory,
           const MissionProgress& progress, model::Answer& answer) const;
  LawOutput calc_law(const LawInput& input) const;

  config::Controller controller;
  std::uint32_t vehicle_id;
  double plant_rod_length;  ///< true length; used only by the wiring `gazebo_plugin`
  double period;            ///< s
  Mission mission;
  std::unique_ptr<const ControlLaw> law;
  bool checks_purity;
};

LawOutput FlightController::Parts::calc_law(const LawInput& input) const {
  const LawOutput output = law->calc(input);
  if (!checks_purity && input.step >= kPurityCheckedSteps) return output;
  if (!are_equal(output, law->calc(input)))
    throw std::runtime_error(
        controller.law.name + ": vehicle " + std::to_string(vehicle_id) + ", step " +
        std::to_string(input.step) +
        ": expected equal answers to equal inputs, got two different ones; what the law must "
        "remember belongs into its memory numbers");
  return output;
}

void FlightController::Parts::fly(std::uint64_t step, const model::Measurement& state,
                                  const model::Numbers& memory, const MissionProgress& progress,
                                  model::Answer& answer) const {
  const double stage_time = static_cast<double>(step - progress.stage_start_step) * period;
  LawInput input{state,
                 progress.reference,
                 memory,
                 step,
                 progress.stage,
                 stage_time,
                 progress.load_reference,
                 progress.load_attitude};
  input.state.rod = calc_wired_angles(state.rod, controller.state_wiring, plant_rod_length);
  if (memory.size() == 0) input.memory.setZero(law->memory_size());  // step 0

  const LawOutput output = calc_law(input);
  if (output.error_code != ErrorCode::kNone) return fail(answer, output.error_code);
  answer.f_Q_W = output.f_Q_W;
  if (controller.drag_feed_forward) {
    answer.f_Q_W = calc_drag_feed_forward(answer.f_Q_W, state.v_WQ, controller.model.air);
  }
  if (controller.saturate) answer.f_Q_W = calc_saturated(answer.f_Q_W, controller.force_limit_n);
  if (!answer.f_Q_W.allFinite() || !output.memory.allFinite())
    return fail(answer, ErrorCode::kNotFinite);
  answer.memory.numbers = output.memory;
}

FlightController::FlightController(const config::Scenario& scenario, std::uint32_t vehicle_id,
                                   bool checks_purity, const LawMaker& make_law)
    : parts_(std::make_unique<const Parts>(scenario, vehicle_id, checks_purity, make_law)) {}

FlightController::~FlightController() = default;
FlightController::FlightController(FlightController&&) noexcept = default;

int FlightController::memory_size() const { return parts_->law->memory_size(); }

model::Answer FlightController::calc_answer(std::uint64_t step, const model::Measurement& state,
                                            const model::ControllerMemory& memory) const {
  model::Answer answer;
  answer.memory = memory;
  answer.stage = memory.stage;
  const Eigen::Index remembered = memory.numbers.size();
  if (!parts_->mission.is_possible(step, memory) ||
      (remembered != 0 && remembered != parts_->law->memory_size())) {
    fail(answer, ErrorCode::kNotFinite);  // a damaged sample: its memory is impossible
    return answer;
  }

  const MissionProgress progress = parts_->mission.calc_progress(step, state, memory);
  answer.memory.stage = progress.remembered_stage;
  answer.memory.stage_start_step = progress.stage_start_step;
  answer.mission = progress.phase;
  answer.reference = progress.reference;
  answer.stage = progress.stage;
  answer.stage_name = parts_->mission.stage_name(progress.stage);

  if (!model::is_finite(state) || !memory.numbers.allFinite()) {
    fail(answer, ErrorCode::kNotFinite);
  } else if (progress.phase == MissionPhase::kFailed) {
    fail(answer, ErrorCode::kStageTimeout);
  } else {
    parts_->fly(step, state, memory.numbers, progress, answer);
  }
  return answer;
}

}  // namespace sls::control
