#include "control_client/answerer.hpp"

#include <spdlog/fmt/fmt.h>

#include "common/bus/convert.hpp"

namespace sls::control {
namespace {

/// The scenario of the client with the period of the run.
config::Scenario make_scenario(config::Scenario scenario, const Parameters& parameters,
                               const std::string& other_flight) {
  if (!(parameters.scenario_sha256() == scenario.sha256))
    throw config::ConfigError(
        fmt::format("scenario '{}': expected the server's, SHA-256 {}, got {}", scenario.name,
                    parameters.scenario_sha256().c_str(), scenario.sha256) +
        other_flight);
  scenario.sync.period_ns = parameters.period_ns();
  scenario.plant.step_ns = parameters.step_ns();
  return scenario;
}

}  // namespace

Answerer::Answerer(const config::Scenario& scenario, const sync::Run& run,
                   const std::vector<std::uint32_t>& vehicle_ids, const Options& options)
    : run_(run),
      scenario_(make_scenario(scenario, run.parameters, options.other_flight)),
      options_(options) {
  for (const std::uint32_t id : vehicle_ids)
    pilots_.emplace(id, Pilot{FlightController(config::make_vehicle_scenario(scenario_, id), id,
                                               options.checks_purity, options.make_law),
                              std::nullopt,
                              {}});
  answers_.client_name(options.name);
  answers_.strength(options.strength);
  answers_.run_id(run.parameters.run_id());
}

const Commands* Answerer::answer(const States& sample) {
  answers_.step(sample.step());
  std::vector<ControlCommand>& answers = answers_.vehicles();
  answers.resize(sample.vehicles().size());  // keeps the memory of those of the last sample
  std::size_t count = 0;
  for (const VehicleState& state : sample.vehicles()) {
    const auto pilot = pilots_.find(state.vehicle_id());
    if (pilot != pilots_.end()) answers[count++] = answer(pilot->second, sample.step(), state);
  }
  answers.resize(count);
  return answers.empty() ? nullptr : &answers_;
}

const ControlCommand& Answerer::answer(Pilot& pilot, std::uint64_t step,
                                       const VehicleState& state) {
  if (pilot.last_step == step) return pilot.last_command;
  const sync::Time began = options_.read_clock();
  model::Answer answer = pilot.controller.calc_answer(step, bus::to_measurement(state.measured()),
                                                      bus::to_memory(state.controller()));
  answer.compute_time = options_.read_clock() - began;
  bus::fill(pilot.last_command, state.vehicle_id(), answer);
  pilot.last_step = step;
  if (answer.error_code != model::ErrorCode::kNone)
    options_.report_error(fmt::format("step {}: fault {}", step, to_string(answer.error_code)));
  return pilot.last_command;
}

}  // namespace sls::control
