#include "worlds/mistakes.hpp"

#include <limits>

namespace sls::worlds {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr std::uint64_t kMissionSteps = 300;  // of a usual flight
constexpr std::uint64_t kFewSteps = 600;      // longer than a stage may last

void keep_first_stage(ControlCommand& answer, std::uint64_t) {
  answer.controller().stage_index(0);
  answer.mission(MissionPhase::MISSION_RUNNING);
}

void keep_running(ControlCommand& answer, std::uint64_t) {
  answer.mission(MissionPhase::MISSION_RUNNING);
}

/// The last stage and the first by turns, once the mission is over.
void lose_stage(ControlCommand& answer, std::uint64_t step) {
  if (step >= kMissionSteps && step % 2 == 1) answer.controller().stage_index(0);
  answer.mission(MissionPhase::MISSION_RUNNING);
}

void change_nothing(ControlCommand&, std::uint64_t) {}

}  // namespace

const std::vector<AnswerMistake>& list_answer_mistakes() {
  using Answer = ControlCommand;
  using Step = std::uint64_t;
  static const std::vector<AnswerMistake> kMistakes = {
      // refused
      {[](Answer& answer, Step) { answer.f_Q_W_n()[2] = kNan; }},
      {[](Answer& answer, Step) { answer.f_Q_W_n()[2] = 1e6; }},
      {[](Answer& answer, Step) { answer.fault(FaultCode::FAULT_ROD_LEVEL); }},
      {[](Answer& answer, Step) { answer.mission(MissionPhase::MISSION_FAILED); }},
      {[](Answer& answer, Step) { answer.fault(static_cast<FaultCode>(99)); }},
      {[](Answer& answer, Step) { answer.mission(static_cast<MissionPhase>(99)); }},
      {[](Answer& answer, Step) { answer.controller().numbers({kNan}); }},
      {[](Answer& answer, Step) { answer.reference().position_m()[0] = kNan; }},
      {[](Answer& answer, Step) { answer.controller().stage_index(99); }},
      {[](Answer& answer, Step) { answer.mission(MissionPhase::MISSION_FINISHED); }},
      // remarked upon
      {[](Answer& answer, Step) { answer.reference().stage_name("\xff"); }},
      {[](Answer& answer, Step) { answer.reference().position_m()[1] = 1e4; }},
      {[](Answer& answer, Step step) { answer.controller().numbers().resize(step % 2); }},
      {[](Answer& answer, Step) { answer.compute_time_ns(50'000'000); }},
      {keep_first_stage, kFewSteps},
      {keep_running, kFewSteps},
      {lose_stage, kFewSteps},
      {change_nothing, kMissionSteps, 40},
      {change_nothing, kFewSteps, 0},
      {[](Answer& answer, Step) { answer.f_Q_W_n()[0] += 1; }, kFewSteps, 2},  // they differ
  };
  return kMistakes;
}

const std::vector<AnnouncementMistake>& list_announcement_mistakes() {
  static const std::vector<AnnouncementMistake> kMistakes = {
      {[](Participant& said) { said.contract_sha256("nonsense"); }},
      {[](Participant& said) { said.contract_sha256(""); }},
      {[](Participant& said) { said.scenario_sha256("nonsense"); }},
      {[](Participant& said) { said.scenario_sha256(""); }},
      {[](Participant& said) { said.ready(false); }},
      {[](Participant& said) { said.ready(false), said.name("\xff"), said.host("\xfe"); }},
      {[](Participant& said) { said.role(static_cast<ParticipantRole>(99)); }},
      {[](Participant& said) { said.vehicle_ids().clear(); }},
      {[](Participant& said) { said.vehicle_ids({77}); }},
      {[](Participant& said) { said.run_id(0); }},
      {[](Participant& said) { said.run_id(said.run_id() + 1); }},
      {[](Participant& said) { said.run_id(0), said.vehicle_ids({77}); }},
      {[](Participant&) {}, false, false, true},
      {[](Participant&) {}, false, false, false},
      {[](Participant& said) { said.ready(false); }, false, true, false},
      {[](Participant& said) { said.role(ParticipantRole::ROLE_RECORDER), said.ready(false); },
       true},
      {[](Participant& said) { said.role(ParticipantRole::ROLE_RECORDER); }, true},
  };
  return kMistakes;
}

}  // namespace sls::worlds
