#include "closed_loop/flight_recorder.hpp"

#include "common/plugin/shared_library.hpp"

namespace sls::closed_loop {

FlightRecorder::FlightRecorder(const std::filesystem::path& folder, bool force,
                               const Parameters& parameters, const config::Sync& sync,
                               const std::string& controller_name)
    : controller_name_(controller_name),
      folder_(folder, force),
      recording_(folder, parameters),
      board_([this](const SimStatus& status) { recording_.add(status); }, parameters.run_id(),
             parameters.vehicles().front().vehicle_id(), sync, [] { return SyncCounters(); }) {
  board_.controller_name = controller_name;
  board_.start_clock();
  board_.publish(RunPhase::PHASE_RUNNING, "");
}

void FlightRecorder::note_law_library(const config::Scenario& scenario) {
  const config::ModelName& law = scenario.controller.law;
  const std::string sha256 = plugin::find_loaded_sha256(law.find_library(scenario.folder));
  if (!sha256.empty()) recording_.note_library(controller_name_, sha256);
}

void FlightRecorder::add(const std::vector<model::StepRecord>& steps) {
  for (const model::StepRecord& step : steps) recording_.add(step);
  board_.step = steps.front().step;
  if (board_.step > 0)
    for (std::size_t i = 0; i < steps.size(); ++i)
      board_.timing.add(model::AnswerKind::kAccepted, 0);
  if (board_.is_due()) board_.publish(RunPhase::PHASE_RUNNING, "");
  recording_.flush_if_due();
}

void FlightRecorder::announce(const std::vector<std::string>& remarks) {
  for (const std::string& remark : remarks) board_.announce(remark);
}

bool FlightRecorder::finish(const std::string& failure) {
  board_.publish(failure.empty() ? RunPhase::PHASE_FINISHED : RunPhase::PHASE_FAILED,
                 failure.empty() ? "mission finished" : failure);
  return recording_.finish("", 0);
}

void FlightRecorder::interrupt(const std::string& reason) { recording_.finish(reason, 0); }

}  // namespace sls::closed_loop
