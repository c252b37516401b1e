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

struct Choice {
  const char* mode;
  int vehicles;
  int controllers;
  int recorders;
  const char* controller;
  const char* recorder;
  double server_deadline_s = 30;
};

constexpr std::array<Choice, 19> kChoices = {{
    {"lockstep", 1, 1, 1, "wait", "wait"},      {"lockstep", 1, 1, 0, "wait", "wait"},
    {"lockstep", 1, 2, 1, "wait", "wait"},      {"lockstep", 1, 2, 2, "wait", "go_on"},
    {"lockstep", 2, 1, 1, "wait", "wait"},      {"lockstep", 3, 2, 1, "wait", "stop"},
    {"lockstep", 1, 1, 1, "hold", "wait"},      {"lockstep", 2, 2, 1, "hold", "go_on"},
    {"lockstep", 1, 1, 1, "failsafe", "go_on"}, {"lockstep", 1, 2, 1, "stop", "wait"},
    {"lockstep", 3, 1, 2, "wait", "go_on"},     {"realtime", 1, 1, 1, "wait", "wait"},
    {"realtime", 1, 2, 1, "hold", "go_on"},     {"realtime", 2, 1, 1, "failsafe", "wait"},
    {"realtime", 1, 2, 0, "stop", "wait"},      {"realtime", 3, 1, 1, "wait", "stop"},
    {"lockstep", 1, 1, 1, "wait", "wait", 4},   {"lockstep", 2, 2, 1, "wait", "wait", 4},
    {"lockstep", 8, 1, 1, "wait", "wait"},  // in two samples
}};

std::string make_text(const Choice& choice) {
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
controller:
  gains: {{ lqr: {{ horizontal: 10, vertical: 5 }} }}
  force_limit_n: 200
mission:
  - figure_eight: {{ amplitude_m: [1.5, 0.75, 0.5], offset_m: [0, 0, -0.5], period_s: 16 }}
    for_s: 1.2
)",
                     choice.vehicles, choice.mode, choice.controllers, choice.recorders,
                     choice.controller, choice.recorder, choice.server_deadline_s);
}

}  // namespace

FlownScenario fly(const config::Scenario& scenario) {
  const auto ids = config::parse_vehicle_ids("all", scenario.vehicles.size());
  FlownScenario flown{scenario, "", 0};
  closed_loop::Flight flight(scenario, ids);
  closed_loop::FlightCertificate certificate(record::make_row_format(
      sim::make_parameters_message(1, ids, scenario, flight.plant(), "world")));
  while (flight.fly_step()) {
    for (const model::StepRecord& record : flight.steps()) certificate.add(record);
    flown.last_step = flight.steps().front().step;
  }
  if (!flight.failure().empty())
    throw config::ConfigError(fmt::format(
        "scenario '{}': expected a flight that finishes in one process, got: step {}: {}",
        scenario.name, flown.last_step, flight.failure()));
  flown.certificate = certificate.finish();
  return flown;
}

std::vector<FlownScenario> make_scenarios() {
  std::vector<FlownScenario> scenarios;
  for (const Choice& choice : kChoices)
    scenarios.push_back(fly(config::parse_scenario(make_text(choice), "world")));
  return scenarios;
}

}  // namespace sls::worlds
