#include "sim_server/core/answer_judge.hpp"

namespace sls::sim {

void AnswerJudge::judge(const Commands& sample, const CommandArrival& arrival, bool is_published) {
  offered_.run_id = sample.run_id();
  offered_.step = sample.step();
  offered_.client_name = sample.client_name().c_str();
  offered_.is_early = !is_published || arrival.arrived.time < published_;
  if (sample.vehicles().empty() && sample.run_id() == run_.run_id)
    run_.watch.check().note_empty(arrival.sender, sample.step());
  for (const ControlCommand& command : sample.vehicles()) {
    offered_.command = command;
    Vehicle* vehicle = run_.fleet.find(command.vehicle_id());
    // The gate of another vehicle refuses and counts it.
    if (!vehicle) vehicle = run_.fleet.vehicles().front().get();
    note(vehicle->gate.offer(offered_, arrival.sender), *vehicle, arrival);
  }
}

void AnswerJudge::note(Verdict verdict, Vehicle& vehicle, const CommandArrival& arrival) {
  ParticipantCheck& check = run_.watch.check();
  if (verdict == Verdict::kLate) {
    run_.outputs.record_late(vehicle, offered_);
    pacing_.note_late(vehicle, offered_, arrival.arrived.time);
  }
  if (*to_string(verdict) != '\0')
    return check.note_rejected(offered_, arrival.sender, verdict, run_.fleet.step());
  check.note_taken(offered_, arrival.sender, verdict, vehicle.applied().memory, vehicle.state());
  if (verdict == Verdict::kSuperseded)
    check.note_superseded(arrival.sender, vehicle.gate.superseded_by());
}

}  // namespace sls::sim
