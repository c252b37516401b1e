#include "bench/samples.hpp"

#include <chrono>
#include <numeric>

#include "bench/in_process_flight.hpp"
#include "common/app/options.hpp"
#include "common/bus/convert.hpp"
#include "control_client/messages.hpp"
#include "sim_server/messages.hpp"

namespace sls::bench {
namespace {

constexpr const char* kController = "control_client";

}  // namespace

std::vector<StepSamples> fly_samples(const config::Scenario& scenario, std::size_t steps,
                                     std::uint64_t run_id) {
  std::vector<StepSamples> samples;
  InProcessFlight flight(scenario);
  sim::Applied applied;
  while (samples.size() < steps) {
    const auto flown = flight.fly_step();
    if (!flown) break;
    StepSamples& sample = samples.emplace_back();
    sample.state = sim::make_state_message(run_id, 0, flown->step, scenario.sync.period_ns,
                                           flown->measured, flown->truth, applied);
    sample.command = control::make_command_message(sample.state, flown->answer, kController, 0,
                                                   std::chrono::nanoseconds(1234));
    sample.reference = control::make_reference_message(sample.state, flown->answer, kController);
    applied.f_Q_W = applied.answer_f_Q_W = flown->answer.f_Q_W;
    applied.origin = FORCE_ANSWERED;
    applied.controller_name = kController;
    applied.memory = sample.command.controller();
  }
  return samples;
}

Parameters make_parameters(const config::Scenario& scenario, std::uint64_t run_id,
                           std::uint32_t vehicles) {
  std::vector<std::uint32_t> ids(vehicles);
  std::iota(ids.begin(), ids.end(), 0);
  return sim::make_parameters_message(run_id, ids, scenario, app::version());
}

SimStatus make_status(std::uint64_t run_id, std::uint64_t index, RunPhase phase,
                      std::uint64_t step) {
  SimStatus status;
  status.run_id(run_id);
  status.sample_index(index);
  status.phase(phase);
  status.step(step);
  status.controller_name(kController);
  status.timing("exact");
  return status;
}

}  // namespace sls::bench
