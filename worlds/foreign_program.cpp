#include "worlds/foreign_program.hpp"

#include <limits>

namespace sls::worlds {

void ForeignProgram::start() {
  random_ = setting_.random.split();
  if (random_.chance(0.8)) peer_.add_writer<Participant>();
  peer_.add_writer<Commands>();
  is_impostor_ = random_.chance(0.5);
  if (is_impostor_) {
    peer_.add_writer<States>();
    peer_.add_writer<RecordBatch>();
    peer_.add_writer<SimStatus>();
  }
  peer_.add_reader<States>([this](const States& sample, const Peer::Arrival&) { answer(sample); });
  setting_.network.announce(peer_);
  wake_soon();
}

void ForeignProgram::wake() {
  if (was_interrupted()) return exit(130, "interrupted");
  repeat_announcement_if_due();
  if (setting_.are_all_others_done()) return exit(0, "");
  wake_at(now() + std::chrono::milliseconds(100));
}

void ForeignProgram::announce_wrongly(std::uint64_t run_id) {
  Participant message;
  const bool has_contract = random_.chance(0.7);
  const bool has_scenario = has_contract && random_.chance(0.5);
  message.contract_sha256(has_contract ? bus::kContractSha256 : "nonsense");
  message.role(ParticipantRole::ROLE_CONTROLLER);
  message.name(name());
  message.host(process_.host().name());
  message.vehicle_ids({0});
  message.strength(9);
  message.scenario_sha256(has_scenario ? setting_.flown->scenario.sha256 : "nonsense");
  message.run_id(run_id);
  message.ready(!has_scenario);
  message.last_complete_step(-1);
  announce(message);
}

/// Says of the run of a server that it has finished, with rows that nobody flew.
void ForeignProgram::pretend(const States& sample) {
  SimStatus status;
  status.run_id(sample.run_id());
  status.sample_index(1'000'000);
  status.phase(random_.chance(0.5) ? RunPhase::PHASE_FINISHED : RunPhase::PHASE_RESET);
  status.step(sample.step());
  RecordBatch batch;
  batch.run_id(sample.run_id());
  batch.batch_index(sample.step() / 64);
  batch.is_last(random_.chance(0.5));
  for (const VehicleState& state : sample.vehicles()) {
    RecordEntry& entry = batch.entries().emplace_back();
    entry.vehicle_id(state.vehicle_id());
    entry.step(sample.step());
  }
  peer_.write(sample);
  peer_.write(batch);
  peer_.write(status);
}

void ForeignProgram::answer(const States& sample) {
  if (sample.run_id() != announced_run_) {
    announced_run_ = sample.run_id();
    announce_wrongly(sample.run_id());
  }
  if (random_.chance(0.7)) return;
  if (is_impostor_ && random_.chance(0.1)) pretend(sample);
  Commands answers;
  answers.client_name(random_.chance(0.8) ? name() : "client-1");
  answers.strength(9);
  answers.run_id(random_.chance(0.9) ? sample.run_id() : random_.next());
  answers.step(sample.step() + static_cast<std::uint64_t>(random_.integer(-2, 2)));
  for (const VehicleState& state : sample.vehicles()) {
    ControlCommand command;
    command.vehicle_id(random_.chance(0.9) ? state.vehicle_id() : 77);
    const double force =
        random_.chance(0.2) ? std::numeric_limits<double>::quiet_NaN() : random_.between(-300, 300);
    command.f_Q_W_n({0, 0, force});
    command.mission(static_cast<MissionPhase>(random_.integer(0, 2)));
    answers.vehicles().push_back(command);
  }
  const std::int64_t copies = random_.integer(1, 3);
  for (std::int64_t i = 0; i < copies; ++i) peer_.write(answers);
}

}  // namespace sls::worlds
