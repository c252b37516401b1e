/// Flies a scenario on the oracle ODE: the server's loop with neither Simbody nor DDS.
#pragma once

#include <cmath>
#include <vector>

#include "common/model/forces.hpp"
#include "control_client/flight_controller.hpp"
#include "tests/oracle/slung_load_ode.hpp"

namespace sls::control {

/// One control period of a flight.
struct FlownStep {
  double time = 0.0;
  oracle::State state;
  Eigen::Vector3d p_WL = Eigen::Vector3d::Zero();
  model::Answer answer;

  Eigen::Vector3d load_error() const { return p_WL - answer.reference.position; }
};

/// The oracle's state at step 0 of `scenario`.
inline oracle::State make_initial_state(const config::Scenario& scenario) {
  const config::InitialState& initial = scenario.plant.initial;
  const model::RodDirection rod = model::to_direction(initial.rod);
  oracle::State state{initial.position, initial.v_WQ, rod.n_W, rod.n_dot_W};
  if (initial.placed == config::Body::kLoad) {
    state.p_WQ -= scenario.vehicle.rod_length * rod.n_W;
  }
  return state;
}

/// Flies until the mission finishes or fails. The last element is that step; its force is not
/// applied. The plant has the true parameters of `scenario`, its drag and its disturbance. Its
/// integration step is at most 1 ms. The control force is held over the period.
inline std::vector<FlownStep> fly(const config::Scenario& scenario) {
  const FlightController controller(scenario);
  const double period = static_cast<double>(scenario.sync.period_ns) / 1e9;
  const int substeps = static_cast<int>(std::ceil(period / 1e-3 - 1e-9));
  const double length = scenario.vehicle.rod_length;
  std::vector<FlownStep> flight;
  model::ControllerMemory memory;
  oracle::State state = make_initial_state(scenario);
  for (std::uint64_t step = 0;; ++step) {
    FlownStep flown;
    flown.time = static_cast<double>(step) * period;
    flown.state = state;
    flown.p_WL = state.p_WQ + length * state.n_W;
    flown.answer = controller.calc_answer(step, oracle::to_model_state(state, length), memory);
    memory = flown.answer.memory;
    const Eigen::Vector3d force = flown.answer.f_Q_W;
    flight.push_back(std::move(flown));
    if (flight.back().answer.mission != MissionPhase::kRunning) return flight;
    const auto total_force = [&](double, const oracle::State& at) -> Eigen::Vector3d {
      return force + scenario.plant.disturbance_W +
             model::calc_rotor_drag(force, at.v_WQ, scenario.plant.air);
    };
    for (int i = 0; i < substeps; ++i) {
      state = oracle::rk4_step_with(state, total_force, period / substeps, scenario.vehicle);
    }
  }
}

struct ErrorStatistics {
  Eigen::Array3d rms = Eigen::Array3d::Zero();
  Eigen::Array3d max = Eigen::Array3d::Zero();
};

/// Load error per axis over the steps with from ≤ time < to.
inline ErrorStatistics calc_error(const std::vector<FlownStep>& flight, double from, double to) {
  ErrorStatistics statistics;
  int count = 0;
  for (const FlownStep& step : flight) {
    if (step.time < from || step.time >= to) continue;
    const Eigen::Array3d error = step.load_error().array();
    statistics.rms += error.square();
    statistics.max = statistics.max.max(error.abs());
    ++count;
  }
  statistics.rms = (statistics.rms / count).sqrt();
  return statistics;
}

}  // namespace sls::control
