#include "control_client/answer_stream.hpp"

namespace sls::control {
namespace {

const char* choose_profile(const bus::Node& node, const LoopKind& kind) {
  if (kind.is_fleet)
    return kind.is_realtime ? node.choose_writer_profile(bus::kRealtimeFleetCommandWriterProfile,
                                                         bus::kFleetWriterProfile)
                            : bus::kFleetWriterProfile;
  return kind.is_realtime ? node.choose_writer_profile(bus::kRealtimeCommandWriterProfile,
                                                       bus::kStreamWriterProfile)
                          : bus::kStreamWriterProfile;
}

/// Puts `answers` into `sample` and writes it.
template <class Sample, class Answer>
void write_sample(bus::Writer<Sample>& writer, Sample& sample, std::vector<Answer>& answers) {
  if (answers.empty()) return;
  sample.run_id(answers.front().run_id());
  sample.step(answers.front().step());
  sample.vehicles().swap(answers);
  writer.write(sample);
  answers.clear();
}

}  // namespace

AnswerStream::Vehicle::Vehicle(bus::Node& node, const char* command_profile, const Handler& handler)
    : references(node),
      commands(node, command_profile),
      states(node, bus::kLoopReaderProfile,
             [handler](const VehicleState& state, const bus::PeerId& sender) {
               handler(&state, 1, sender);
             }) {}

AnswerStream::Fleet::Fleet(bus::Node& node, const char* command_profile, const Handler& handler)
    : references(node),
      commands(node, command_profile),
      states(node, bus::kFleetLoopReaderProfile,
             [handler](const FleetState& sample, const bus::PeerId& sender) {
               handler(sample.vehicles().data(), sample.vehicles().size(), sender);
             }) {}

AnswerStream::AnswerStream(bus::Node& node, const LoopKind& kind, Handler handler) : kind_(kind) {
  const char* profile = choose_profile(node, kind);
  if (kind.is_fleet)
    fleet_.emplace(node, profile, handler);
  else
    vehicle_.emplace(node, profile, handler);
}

/// The references first: once a command is out the server moves on, and a client that is killed
/// then must not have kept back what a recorder needs of this step.
void AnswerStream::write(std::vector<Reference>& references,
                         std::vector<ControlCommand>& commands) {
  if (fleet_) {
    write_sample(fleet_->references, fleet_->reference_sample, references);
    write_sample(fleet_->commands, fleet_->command_sample, commands);
    return;
  }
  for (const Reference& reference : references) vehicle_->references.write(reference);
  for (const ControlCommand& command : commands) vehicle_->commands.write(command);
}

bool AnswerStream::sees_server(const bus::PeerId& server) const {
  return look([&](const auto& topics) {
    return topics.states.matched().count(server) > 0 && topics.commands.matched().count(server) > 0;
  });
}

bool AnswerStream::sees_recorder(const bus::PeerId& recorder) const {
  return look([&](const auto& topics) {
    return topics.commands.matched().count(recorder) > 0 &&
           topics.references.matched().count(recorder) > 0;
  });
}

void AnswerStream::wait_for_acknowledgments(std::chrono::milliseconds limit) {
  if (vehicle_) {
    vehicle_->commands.wait_for_acknowledgments(limit);
    vehicle_->references.wait_for_acknowledgments(limit);
  } else {
    fleet_->commands.wait_for_acknowledgments(limit);
    fleet_->references.wait_for_acknowledgments(limit);
  }
}

}  // namespace sls::control
