#include "worlds/scenarios.hpp"

#include <spdlog/fmt/fmt.h>

#include <array>

#include "closed_loop/flight.hpp"
#include "closed_loop/flight_certificate.hpp"
#include "common/config/vehicle_ids.hpp"
#include "recorder/rows.hpp"
#include "sim_server/messages.hpp"

namespace sls::worlds {
namespace {

/// The difference from a plain flight, as YAML.
struct Part {
  const char* vehicles = nullptr;  // instead of a number
  const char* gains = "lqr: { horizontal: 10, vertical: 5 }";
  const char* mission = R"(
  - figure_eight: { amplitude_m: [1.5, 0.75, 0.5], offset_m: [0, 0, -0.5], period_s: 16 }
    for_s: 1.2
)";
  const char* further = "";
};

const Part kPlain;
/// All kinds of faults, on both channels.
const Part kFaults{nullptr, kPlain.gains, kPlain.mission, R"(
faults:
  - delay: { on: state, by_s: 0.008, from_s: 0.2, to_s: 0.9 }
  - noise: { on: state, seed: 3, position_m: [0.002, 0.002, 0.002], alpha_rad: 0.001 }
  - drop: { on: state, probability: 0.2, seed: 7 }
  - bias: { on: state, beta_rad: 0.01, from_s: 0.4 }
  - freeze: { on: state, from_s: 0.5, to_s: 0.52 }
  - reorder: { on: state, probability: 0.1 }
  - delay: { on: command, by_s: 0.004 }
  - noise: { on: command, force_n: [0.1, 0.1, 0.1] }
  - drop: { on: command, probability: 0.1 }
  - bias: { on: command, force_n: [0, 0.3, 0], from_s: 0.3, to_s: 0.6 }
  - freeze: { on: command, from_s: 0.7, to_s: 0.71 }
  - reorder: { on: command, probability: 0.1, seed: 2 }
)"};
const Part kSensing{nullptr, kPlain.gains, kPlain.mission, R"(
sensing: { period_s: 0.008, age_s: 0.012, rod: { age_s: 0.004 }, node_delay_s: 0.004 }
estimator: { position_m: [0.01, 0, 0.02] }
)"};
/// A law that remembers numbers, and stages with each way to leave.
const Part kStages{nullptr,
                   "horizontal: { position: 3.2469, velocity: 8.5803, acceleration: 9.8503, "
                   "jerk: 5.4498, integral: 0.0316 }, "
                   "vertical: { position: 2.2667, velocity: 3.0876, integral: 0.0224 }",
                   R"(
  - hold: { position_m: [0, 0, -0.5] }
    for_s: 0.1
  - set_point: { position_m: [0.01, 0, -0.52] }
    until: { within_m: 0.015, after_s: 0.1 }
  - rest_to_rest: { from_m: [0.01, 0, -0.52], to_m: [0, 0, -0.5], duration_s: 0.3 }
    until: { within_m: 0.1, of: quadrotor, offset_m: [0, 0, -1], after_s: 0.1 }
  - figure_eight: { amplitude_m: [0.1, 0.1, 0], offset_m: [0, 0, -0.5], period_s: 16 }
    for_s: 0.1
)"};
/// Vehicles that leave a stage at different steps, the last one with faults.
const Part kMixedFleet{R"(
  - {}
  - { offset_m: [4, 0, 0], load_mass_kg: 0.25 }
  - { offset_m: [0, 4, 0], load_mass_kg: 0.15, quad_mass_kg: 1.2, rod_length_m: 0.7 }
)",
                       kPlain.gains, R"(
  - set_point: { position_m: [0, 0, -0.6] }
    until: { within_m: 0.08 }
  - hold: { position_m: [0, 0, -0.6] }
    for_s: 0.64
)",
                       R"(
faults:
  - bias: { on: state, vehicle: 2, position_m: [0.01, 0, 0] }
  - bias: { on: command, vehicle: 2, force_n: [0, 0.3, 0] }
)"};
/// Whatever the vehicle does, this force makes its state not finite.
const Part kBrokenPlant{nullptr, kPlain.gains, kPlain.mission, R"(
faults:
  - bias: { on: command, force_n: [1.0e+300, 1.0e+300, 1.0e+300], from_s: 0.8 }
)"};
const Part kEndlessStage{nullptr, kPlain.gains, R"(
  - set_point: { position_m: [9, 0, -0.5] }
    until: { within_m: 0.01, timeout_s: 0.8 }
)"};

struct Choice {
  const char* mode;
  int vehicles;
  int controllers;
  int recorders;
  const char* controller;
  const char* recorder;
  const Part& part = kPlain;
  double server_deadline_s = 30;
  double take_over_s = 0.1;
};

const std::array<Choice, 23> kChoices = {{
    {"lockstep", 1, 1, 1, "wait", "wait"},
    {"lockstep", 1, 1, 0, "wait", "wait"},
    {"lockstep", 1, 2, 1, "wait", "wait", kStages},
    {"lockstep", 1, 2, 2, "wait", "go_on", kPlain, 30, 4},  // the dead are known earlier
    {"lockstep", 2, 1, 1, "wait", "wait", kFaults},
    {"lockstep", 3, 2, 1, "wait", "stop"},
    {"lockstep", 1, 1, 1, "hold", "wait", kFaults},
    {"lockstep", 2, 2, 1, "hold", "go_on"},
    {"lockstep", 1, 1, 1, "failsafe", "go_on", kSensing},
    {"lockstep", 1, 2, 1, "stop", "wait"},
    {"lockstep", 3, 1, 2, "wait", "go_on", kMixedFleet},
    {"realtime", 1, 1, 1, "wait", "wait", kSensing},
    {"realtime", 1, 2, 1, "hold", "go_on"},
    {"realtime", 2, 1, 1, "failsafe", "wait", kFaults},
    {"realtime", 1, 2, 0, "stop", "wait"},
    {"realtime", 3, 1, 1, "wait", "stop", kMixedFleet},
    {"realtime", 2, 1, 1, "wait", "go_on"},
    {"lockstep", 1, 1, 1, "wait", "wait", kPlain, 4},
    {"lockstep", 2, 2, 1, "wait", "wait", kPlain, 4},
    {"lockstep", 8, 1, 1, "wait", "wait"},  // in two samples
    // Flights that fail.
    {"lockstep", 1, 1, 1, "wait", "wait", kBrokenPlant},
    {"realtime", 2, 1, 1, "hold", "wait", kBrokenPlant},
    {"lockstep", 1, 1, 1, "wait", "wait", kEndlessStage},
}};

std::string make_text(const Choice& choice) {
  const Part& part = choice.part;
  return fmt::format(R"(name: world
vehicles: {}
vehicle: {{ quad_mass_kg: 1.5, load_mass_kg: 0.2, rod_length_m: 1.0, gravity_m_s2: 9.8 }}
plant:
  model: analytic
  step_s: 0.004
  initial: {{ load_position_m: [0, 0, -0.5] }}
sync:
  mode: {}
  period_s: 0.004
  wait_for: {{ controllers: {}, recorders: {}, timeout_s: 8 }}
  wait: {{ controller: {{ policy: {} }}, recorder: {{ policy: {} }}, server: {{ deadline_s: {} }} }}
  take_over_s: {}
controller:
  gains: {{ {} }}
  force_limit_n: 200
mission:{}{})",
                     part.vehicles ? part.vehicles : std::to_string(choice.vehicles), choice.mode,
                     choice.controllers, choice.recorders, choice.controller, choice.recorder,
                     choice.server_deadline_s, choice.take_over_s, part.gains, part.mission,
                     part.further);
}

/// Flies these vehicles and adds the result to `flown`.
void fly(const FlownScenario::VehicleIds& ids, FlownScenario& flown) {
  closed_loop::Flight flight(flown.scenario, ids);
  closed_loop::FlightCertificate certificate(record::make_row_format(
      sim::make_parameters_message(1, ids, flown.scenario, flight.plant(), "world")));
  while (flight.fly_step()) {
    for (const model::StepRecord& record : flight.steps()) certificate.add(record);
    flown.last_step = flight.steps().front().step;
  }
  flown.failure = flight.failure();
  flown.is_refused = flight.steps().front().kind == model::AnswerKind::kRefused;
  flown.certificates[ids] = certificate.finish();
}

}  // namespace

FlownScenario fly(const config::Scenario& scenario) {
  const auto ids = config::parse_vehicle_ids("all", scenario.vehicles.size());
  FlownScenario flown;
  flown.scenario = scenario;
  fly(ids, flown);
  if (!flown.failure.empty() || ids.size() == 1) return flown;
  FlownScenario part = flown;
  fly({ids.front()}, part);
  fly({ids.begin() + 1, ids.end()}, part);
  flown.certificates = std::move(part.certificates);
  return flown;
}

std::vector<FlownScenario> make_scenarios() {
  std::vector<FlownScenario> scenarios;
  for (const Choice& choice : kChoices)
    scenarios.push_back(fly(config::parse_scenario(make_text(choice), "world")));
  return scenarios;
}

}  // namespace sls::worlds
