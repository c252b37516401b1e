#include "closed_loop/flight_recorder.hpp"

#include "common/app/log.hpp"
#include "common/app/stop_signal.hpp"
#include "common/app/version.hpp"
#include "common/plugin/shared_library.hpp"
#include "sim_server/messages.hpp"

namespace sls::closed_loop {

FlightRecorder::FlightRecorder(const std::filesystem::path& folder, bool force,
                               const Parameters& parameters, const config::Sync& sync,
                               const std::string& controller_name)
    : controller_name_(controller_name),
      folder_(folder, force),
      recording_(folder, parameters),
      status_(parameters.run_id(), parameters.vehicles().front().vehicle_id(), sync) {
  status_.begin(Clock::now());
  add_status(RunPhase::PHASE_RUNNING, "");
}

void FlightRecorder::note_law_library(const config::Scenario& scenario) {
  const config::ModelName& law = scenario.controller.law;
  const std::string sha256 = plugin::find_loaded_sha256(law.find_library(scenario.folder));
  if (!sha256.empty()) recording_.note_library(controller_name_, sha256);
}

void FlightRecorder::add_status(RunPhase phase, const std::string& reason) {
  recording_.add(status_.make({phase, reason, step_, controller_name_}, Clock::now()));
}

void FlightRecorder::add(const std::vector<model::StepRecord>& steps) {
  for (const model::StepRecord& step : steps) recording_.add(step);
  step_ = steps.front().step;
  if (step_ > 0)
    for (std::size_t i = 0; i < steps.size(); ++i)
      status_.timing.add(model::AnswerKind::kAccepted, 0);
  if (status_.is_due(Clock::now())) add_status(RunPhase::PHASE_RUNNING, "");
  recording_.flush_if_due();
}

void FlightRecorder::announce(const std::vector<std::string>& remarks) {
  for (const std::string& remark : remarks) {
    app::log({true, remark});
    add_status(RunPhase::PHASE_RUNNING, remark);
  }
}

bool FlightRecorder::finish(const std::string& failure) {
  add_status(failure.empty() ? RunPhase::PHASE_FINISHED : RunPhase::PHASE_FAILED,
             failure.empty() ? "mission finished" : failure);
  return recording_.finish("", 0);
}

void FlightRecorder::interrupt(const std::string& reason) { recording_.finish(reason, 0); }

FlightEnd fly_recorded(const config::Scenario& scenario, const FlightOptions& options,
                       const std::filesystem::path& folder, bool force) {
  const std::vector<std::uint32_t> ids = list_vehicles(scenario);
  Flight flight(scenario, ids, options);
  FlightRecorder recorder(folder, force,
                          sim::make_parameters_message(sim::make_run_id(), ids, scenario,
                                                       flight.plant(), app::version()),
                          scenario.sync, options.controller_name);
  recorder.note_law_library(scenario);
  const plugin::LastWords words(
      [&recorder](const std::string& reason) { recorder.interrupt(reason); });
  while (app::stop_signal() == 0 && flight.fly_step()) {
    recorder.add(flight.steps());
    recorder.announce(flight.take_remarks());
  }
  recorder.announce(flight.take_remarks());  // of a step that failed
  if (app::stop_signal() != 0) {
    recorder.interrupt("interrupted");
    return {recorder.last_step(), "interrupted", false};
  }
  return {recorder.last_step(), flight.failure(), recorder.finish(flight.failure())};
}

}  // namespace sls::closed_loop
