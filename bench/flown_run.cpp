#include "bench/flown_run.hpp"

#include "closed_loop/flight.hpp"
#include "common/app/options.hpp"
#include "sim_server/messages.hpp"

namespace sls::bench {

std::vector<model::StepRecord> fly_records(const config::Scenario& scenario, std::size_t steps) {
  std::vector<model::StepRecord> records;
  closed_loop::Flight flight(scenario);
  while (records.size() < steps) {
    const model::StepRecord* flown = flight.fly_step();
    if (!flown) break;
    records.push_back(*flown);
  }
  records.back().answer.mission = model::MissionPhase::kFinished;
  return records;
}

Parameters make_parameters(const config::Scenario& scenario, std::uint64_t run_id,
                           std::uint32_t vehicles) {
  const closed_loop::Flight flight(scenario);
  Parameters parameters =
      sim::make_parameters_message(run_id, {0}, scenario, flight.plant(), app::version());
  parameters.vehicles().resize(vehicles, parameters.vehicles().front());
  for (std::uint32_t id = 0; id < vehicles; ++id) parameters.vehicles()[id].vehicle_id(id);
  return parameters;
}

SimStatus make_status(std::uint64_t run_id, std::uint64_t index, RunPhase phase,
                      std::uint64_t step) {
  SimStatus status;
  status.run_id(run_id);
  status.sample_index(index);
  status.phase(phase);
  status.step(step);
  status.controller_name("control_client");
  status.timing("exact");
  return status;
}

}  // namespace sls::bench
