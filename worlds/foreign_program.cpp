#include "worlds/foreign_program.hpp"

#include <spdlog/fmt/fmt.h>

#include <limits>

namespace sls::worlds {

void ForeignProgram::start() {
  random_ = setting_.random.split();
  const auto& mistakes = list_announcement_mistakes();
  if (random_.chance(0.8)) mistake_ = &mistakes[random_.index(mistakes.size())];
  if (mistake_ && mistake_->is_wild && !options_.is_wild) mistake_ = &mistakes.front();
  if (mistake_) peer_.add_writer<Participant>();
  if (!mistake_ || mistake_->writes_answers) peer_.add_writer<Commands>(random_.chance(0.8));
  is_impostor_ = random_.chance(0.5);
  if (is_impostor_) {
    peer_.add_writer<States>();
    peer_.add_writer<RecordBatch>();
    peer_.add_writer<SimStatus>();
  }
  peer_.add_reader<Parameters>([this](const Parameters& sample, const Peer::Arrival&) {
    if (runs_.insert(sample.run_id()).second) announce_wrongly(sample);
  });
  if (!mistake_ || mistake_->reads_states)
    peer_.add_reader<States>(
        [this](const States& sample, const Peer::Arrival&) { answer(sample); });
  setting_.network.announce(peer_);
  if (options_.is_crowd) make_crowd();
  wake_soon();
}

void ForeignProgram::make_crowd() {
  for (std::size_t i = 0; i <= sync::Membership::kMostMembers; ++i) {
    Peer& peer = *crowd_.emplace_back(&setting_.network.join(process_));
    peer.add_writer<Participant>();
    peer.add_writer<SimStatus>();
    setting_.network.announce(peer);
    Participant message;
    message.name(fmt::format("{}-{}", name(), i));
    peer.write(message);
    SimStatus status;
    status.run_id(random_.next());
    peer.write(status);
  }
}

void ForeignProgram::leave_with_crowd(bool with_goodbye) {
  for (Peer* peer : crowd_) setting_.network.leave(*peer, with_goodbye);
}

void ForeignProgram::wake() {
  repeat_announcement_if_due();
  if (!was_interrupted() && !setting_.are_all_others_done())
    return wake_at(now() + std::chrono::milliseconds(100));
  leave_with_crowd(true);
  exit(was_interrupted() ? 130 : 0, stop_signal_);
}

void ForeignProgram::announce_wrongly(const Parameters& parameters) {
  Participant message;
  message.contract_sha256(bus::kContractSha256);
  message.role(ParticipantRole::ROLE_CONTROLLER);
  message.name(name());
  message.host(process_.host().name());
  message.vehicle_ids(sync::list_vehicle_ids(parameters));
  message.strength(9);
  message.scenario_sha256(parameters.scenario_sha256());
  message.run_id(parameters.run_id());
  message.ready(true);
  message.last_complete_step(-1);
  if (mistake_) {
    mistake_->make(message);
    announce(message);
  }
  if (!random_.chance(0.5)) return;
  Commands early;  // before there is a state
  early.client_name(name());
  early.run_id(parameters.run_id());
  for (const std::uint32_t id : sync::list_vehicle_ids(parameters))
    early.vehicles().emplace_back().vehicle_id(id);
  peer_.write(early);
}

/// Says of the run of a server that it has finished, with rows that nobody flew.
void ForeignProgram::pretend(const States& sample) {
  SimStatus status;
  status.run_id(random_.chance(0.8) ? sample.run_id() : random_.next());
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
  if (random_.chance(0.7)) return;
  if (is_impostor_ && random_.chance(0.1)) pretend(sample);
  Commands answers;
  answers.client_name(random_.chance(0.8) ? name() : "controller-1");
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
