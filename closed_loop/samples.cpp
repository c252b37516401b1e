#include "closed_loop/samples.hpp"

#include <numeric>

#include "common/app/options.hpp"
#include "control_client/messages.hpp"

namespace sls::closed_loop {
namespace {

constexpr const char* kController = "control_client";

}  // namespace

StepSamples SampleMaker::make(const FlownStep& flown, const std::string& controller_name) {
  applied_.f_Q_W = flown.applied_f_Q_W;
  applied_.answer_f_Q_W = flown.answered_f_Q_W;
  StepSamples samples;
  samples.state = sim::make_state_message(run_id_, vehicle_id_, flown.step, period_ns_,
                                          flown.measured, flown.truth, applied_);
  samples.command = control::make_command_message(samples.state, flown.answer, controller_name, 0,
                                                  flown.compute_time);
  samples.reference = control::make_reference_message(samples.state, flown.answer, controller_name);
  applied_.origin = FORCE_ANSWERED;
  applied_.controller_name = controller_name;
  applied_.memory = samples.command.controller();
  return samples;
}

std::vector<StepSamples> fly_samples(const config::Scenario& scenario, std::size_t steps,
                                     std::uint64_t run_id) {
  std::vector<StepSamples> samples;
  Flight flight(scenario);
  SampleMaker maker(run_id, 0, scenario.sync.period_ns);
  while (samples.size() < steps) {
    const FlownStep* flown = flight.fly_step();
    if (!flown) break;
    samples.push_back(maker.make(*flown, kController));
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

}  // namespace sls::closed_loop
