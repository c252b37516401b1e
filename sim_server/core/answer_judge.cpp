#include "sim_server/core/answer_judge.hpp"

namespace sls::sim {

void AnswerJudge::judge(CommandSample& sample, bool is_published) {
  if (sample.answers.empty() && sample.run_id == run_.run_id) {
    run_.watch.answers().note_empty(sample.sender, sample.step);
    for (const auto& vehicle : run_.fleet.vehicles())
      vehicle->gate.note_sign_of_life(sample.sender);
  }
  for (OfferedAnswer& offered : sample.answers) {
    offered.is_early = !is_published || sample.arrived.time < published_;
    Vehicle* vehicle = run_.fleet.find(offered.vehicle_id);
    // The gate of another vehicle refuses and counts it.
    if (!vehicle) vehicle = run_.fleet.vehicles().front().get();
    const Verdict verdict = vehicle->gate.offer(offered, sample.sender);
    note(verdict, *vehicle, offered, sample);
  }
}

void AnswerJudge::note(Verdict verdict, Vehicle& vehicle, const OfferedAnswer& offered,
                       const CommandSample& sample) {
  AnswerCheck& check = run_.watch.answers();
  if (verdict == Verdict::kLate) {
    run_.outputs.record_late(vehicle, offered);
    pacing_.note_late(vehicle, offered, sample.arrived.time);
  }
  if (*to_string(verdict) != '\0')
    return check.note_rejected(offered, sample.sender, verdict, run_.fleet.step());
  check.note_taken(offered, sample.sender, verdict);
}

}  // namespace sls::sim
