#include <atomic>
#include <chrono>
#include <limits>
#include <mutex>
#include <optional>
#include <random>
#include <thread>

#include "common/bus/node.hpp"
#include "common/bus/participants.hpp"
#include "tests/hostile/attack.hpp"

namespace sls::hostile {
namespace {

using namespace std::chrono_literals;

const std::string kQosFile = SLS_SOURCE_DIR "/config/qos/lan.xml";
constexpr auto kPause = 1ms;
constexpr const char* kPilot = "control_client";  // the real client's name

/// An ordinary participant, with the public data of a run: its parameters, scenario and state.
class Stranger {
 public:
  explicit Stranger(const Target& target)
      : node(kQosFile, target.domain, "stranger"),
        servers(node),
        state_reader_(node, bus::kLoopReaderProfile,
                      [this](const States& sample, const bus::PeerId&) {
                        const std::lock_guard lock(mutex_);
                        state_ = sample;
                      }) {}

  /// Waits until the server flies; false if the attack ends before.
  bool wait_for_flight(const Target& target) {
    while (goes_on(target)) {
      run = servers.find_joinable(0);
      if (run && run->status->phase() == RunPhase::PHASE_RUNNING && state()) return true;
      std::this_thread::sleep_for(5ms);
    }
    return false;
  }
  bool is_flying() const {
    const auto status = servers.find_status(run->parameters.run_id());
    return status && status->phase() == RunPhase::PHASE_RUNNING;
  }
  std::optional<States> state() const {
    const std::lock_guard lock(mutex_);
    return state_;
  }
  std::uint64_t run_id() const { return run->parameters.run_id(); }

  Commands make_commands(const std::string& name) const {
    Commands sample;
    sample.run_id(run_id());
    sample.step(state()->step());
    sample.client_name(name);
    sample.strength(1000);
    sample.vehicles().emplace_back().f_Q_W_n({1.0, 0.0, -16.0});
    return sample;
  }
  Participant make_announcement(ParticipantRole role) const {
    Participant message;
    message.run_id(run_id());
    message.contract_sha256(bus::kContractSha256);
    message.role(role);
    message.name("stranger");
    message.host("nowhere");
    message.strength(std::numeric_limits<std::int32_t>::max());
    message.vehicle_ids({0});
    message.scenario_sha256(run->parameters.scenario_sha256());
    message.ready(true);
    message.last_complete_step(-1);
    return message;
  }

  bus::Node node;
  bus::ServerDirectory servers;
  std::optional<sync::Run> run;

 private:
  mutable std::mutex mutex_;
  std::optional<States> state_;
  bus::Reader<States> state_reader_;
};

/// Gives `sample` one of several errors.
void spoil(Commands& sample, std::mt19937_64& random) {
  ControlCommand& command = sample.vehicles().front();
  switch (random() % 10) {
    case 0:
      return command.f_Q_W_n({std::numeric_limits<double>::quiet_NaN(), 0, 0});
    case 1:
      return command.f_Q_W_n({0, 0, -1e300});
    case 2:
      return sample.run_id(random());
    case 3:
      return command.vehicle_id(static_cast<std::uint32_t>(random()));
    case 4:
      command.mission(MissionPhase::MISSION_FAILED);
      return command.fault(FaultCode::FAULT_FREE_FALL);
    case 5:
      return sample.step(random());
    case 6:
      return sample.step(sample.step() + random() % 10000);
    case 7:
      return sample.vehicles().resize(SAMPLE_VEHICLES, command);  // the same vehicle
    case 8:
      return command.controller().numbers().resize(MOST_NUMBERS);
    default:
      return command.mission(MissionPhase::MISSION_FINISHED);
  }
}

}  // namespace

std::uint64_t come_and_go(const Target& target) {
  std::uint64_t count = 0;
  for (; goes_on(target); ++count) {
    bus::Node node(kQosFile, target.domain, "passer-by");
    bus::Writer<Participant> writer(node);
    bus::Reader<RecordBatch> reader(node, bus::kRecordReaderProfile,
                                    [](const RecordBatch&, const bus::PeerId&) {});
    Participant message;
    message.name("passer-by");
    message.role(count % 2 ? ParticipantRole::ROLE_CONTROLLER : ParticipantRole::ROLE_RECORDER);
    writer.write(message);
    say_that_it_fires();
    writer.wait_for_acknowledgments(50ms);
  }
  return count;
}

std::uint64_t flood_commands(const Target& target) {
  Stranger stranger(target);
  bus::Writer<Commands> commands(stranger.node);
  if (!stranger.wait_for_flight(target)) return 0;
  std::mt19937_64 random(target.seed);
  std::uint64_t count = 0;
  while (goes_on(target)) {
    for (int i = 0; i < 20; ++i, ++count) {
      Commands sample = stranger.make_commands(random() % 2 ? kPilot : "stranger");
      spoil(sample, random);
      commands.write(sample);
    }
    say_that_it_fires();
    std::this_thread::sleep_for(kPause);
  }
  return count;
}

std::uint64_t forge_statements(const Target& target) {
  Stranger stranger(target);
  bus::Writer<States> states(stranger.node);
  bus::Writer<RecordBatch> batches(stranger.node);
  bus::Writer<SimStatus> statuses(stranger.node);
  bus::Writer<Parameters> parameters(stranger.node);
  bus::Writer<Participant> participants(stranger.node);
  if (!stranger.wait_for_flight(target)) return 0;
  std::mt19937_64 random(target.seed);
  std::uint64_t count = 0;
  // Stops with the flight, because a recorder that is present and not done delays the end by up to
  // 10 s.
  for (; goes_on(target) && stranger.is_flying(); count += 6) {
    States state = *stranger.state();  // the current or a next state, with another load position
    state.step(state.step() + random() % 3);
    VehicleState& vehicle = state.vehicles().front();
    vehicle.measured().p_WL_m({1e3, 1e3, 1e3});
    states.write(state);
    RecordBatch batch;  // the same for recorders; often marked as the last batch
    batch.run_id(stranger.run_id());
    batch.batch_index(random() % 3 ? state.step() / 20 + random() % 3 : random());
    batch.is_last(random() % 2);
    RecordEntry& entry = batch.entries().emplace_back();
    entry.step(state.step());
    entry.kind(static_cast<AnswerKind>(random() % 6));
    entry.truth(vehicle.measured());
    entry.client_name(kPilot);
    batches.write(batch);
    SimStatus status;  // claims that the flight has ended
    status.run_id(stranger.run_id());
    status.sample_index(1 << 30);
    status.phase(random() % 2 ? RunPhase::PHASE_FINISHED : RunPhase::PHASE_FAILED);
    status.step(state.step());
    statuses.write(status);
    Parameters claim = stranger.run->parameters;  // of this run, or of a server with a lower run_id
    if (random() % 2) claim.run_id(1);
    parameters.write(claim);
    status.run_id(1);
    status.phase(RunPhase::PHASE_WAITING);
    statuses.write(status);
    participants.write(
        stranger.make_announcement(ParticipantRole::ROLE_RECORDER));  // has recorded nothing yet
    say_that_it_fires();
    std::this_thread::sleep_for(5 * kPause);
  }
  return count;
}

std::uint64_t flood_control(const Target& target) {
  Stranger stranger(target);
  bus::Writer<SimControl> requests(stranger.node);
  if (!stranger.wait_for_flight(target)) return 0;
  std::mt19937_64 random(target.seed);
  std::uint64_t count = 0;
  for (; goes_on(target); ++count) {
    SimControl request;
    request.run_id(random() % 2 ? stranger.run_id() : random());
    request.request_id(random());
    request.operator_name("mallory");
    request.action(random() % 2 ? ControlAction::ACTION_STEP
                                : ControlAction::ACTION_START);  // refused: it is not paused
    if (request.run_id() != stranger.run_id()) request.action(ControlAction::ACTION_STOP);
    if (random() % 4 == 0) request.action(static_cast<ControlAction>(random() % 1000 + 100));
    request.steps(random());
    requests.write(request);
    say_that_it_fires();
    std::this_thread::sleep_for(kPause);
  }
  return count;
}

std::uint64_t pose_as_controller(const Target& target, bool answers) {
  Stranger stranger(target);
  bus::Writer<Participant> participants(stranger.node);
  bus::Writer<Commands> commands(stranger.node);
  if (!stranger.wait_for_flight(target)) return 0;
  participants.write(stranger.make_announcement(ParticipantRole::ROLE_CONTROLLER));
  say_that_it_fires();
  std::uint64_t count = 1;
  std::uint64_t answered = 0;
  while (goes_on(target)) {
    const std::uint64_t step = stranger.state()->step();
    if (!answers || step == answered) {
      std::this_thread::sleep_for(100us);
      continue;
    }
    Commands sample = stranger.make_commands("stranger");
    sample.step(answered = step);
    sample.vehicles().front().f_Q_W_n({std::numeric_limits<double>::infinity(), 0, 0});
    commands.write(sample);
    ++count;
  }
  return count;
}

std::uint64_t read_all(const Target& target) {
  bus::Node node(kQosFile, target.domain, "deaf");
  std::atomic<std::uint64_t> count{0};
  const auto hear = [&](const auto&, const bus::PeerId&) { ++count; };
  // Reads the loop's topics reliably as well.
  const bus::Reader<States> states(node, bus::kRecordReaderProfile, hear);
  const bus::Reader<Commands> commands(node, bus::kRecordReaderProfile, hear);
  const bus::Reader<RecordBatch> batches(node, bus::kRecordReaderProfile, hear);
  const bus::Reader<SimStatus> statuses(node, bus::kLatchedReaderProfile, hear);
  say_that_it_fires();
  while (goes_on(target)) std::this_thread::sleep_for(10ms);
  return count;
}

}  // namespace sls::hostile
