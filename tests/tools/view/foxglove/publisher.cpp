// Reserves a domain for the test and publishes on it as a server, a controller and a recorder. The
// numbers follow formulas that channels_test.mjs repeats. stdout: {"domain":N}; then one JSON line
// for each command on stdin: "reset", "fleet VEHICLES", "rest", "burst RATE SECONDS".
// Ends at the end of stdin.
//   view_foxglove_publisher hold|publish
#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstring>
#include <iostream>
#include <numeric>
#include <optional>
#include <sstream>
#include <string>
#include <thread>

#include "common/bus/node.hpp"
#include "tests/support/own_domain.hpp"

namespace {

using namespace sls;
using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

constexpr std::int64_t kPeriod = 4'000'000;

class Publisher {
 public:
  explicit Publisher(int domain) : node_(SLS_SOURCE_DIR "/config/qos/udp.xml", domain, "played") {}

  void begin_run(std::uint64_t run_id, std::vector<std::uint32_t> vehicles) {
    run_id_ = run_id;
    vehicles_ = std::move(vehicles);
    step_ = 0;
    batch_ = 0;
    Parameters parameters;
    parameters.run_id(run_id_);
    parameters.contract_sha256(bus::kContractSha256);
    parameters.scenario_text("name: played");
    parameters.period_ns(kPeriod);
    parameters.mode(SyncMode::MODE_REALTIME);
    parameters.real_time_factor(1);
    for (const std::uint32_t id : vehicles_) parameters.vehicles().emplace_back().vehicle_id(id);
    parameters_.write(parameters);
    write_status();
  }

  void write_step() {
    ++step_;
    states_.write(make_states());
    write_commands();
    write_record();
    if (step_ % 25 == 0) write_latched();
  }

  void write_latched() {
    write_status();
    Participant participant;
    participant.run_id(run_id_);
    participant.contract_sha256(bus::kContractSha256);
    participant.role(ParticipantRole::ROLE_CONTROLLER);
    participant.name("pilot");
    participant.host("here");
    participant.vehicle_ids(vehicles_);
    participant.last_complete_step(-1);
    participants_.write(participant);
    SimControl control;
    control.run_id(run_id_);
    control.request_id(step_);
    control.operator_name("anna@ground");
    control.action(ControlAction::ACTION_STEP);
    control.steps(5);
    controls_.write(control);
    SimControlReply reply;
    reply.run_id(run_id_);
    reply.request_id(step_);
    reply.accepted(false);
    reply.reason("played");
    reply.step(step_);
    replies_.write(reply);
  }

  States make_states() const {
    States states;
    states.run_id(run_id_);
    states.step(step_);
    states.sim_time_ns(static_cast<std::int64_t>(step_) * kPeriod);
    for (const std::uint32_t id : list_first_vehicles()) {
      VehicleState& vehicle = states.vehicles().emplace_back();
      vehicle.vehicle_id(id);
      vehicle.measured(make_plant_state(id));
      vehicle.force_origin(ForceOrigin::FORCE_ANSWERED);
      vehicle.controller_name("pilot");
      vehicle.controller().numbers({static_cast<double>(step_), 2.5});
    }
    return states;
  }

  /// Publishes only states, `rate` a second for `seconds`; the step of each is its number.
  std::uint64_t burst(double rate, double seconds) {
    States states = make_states();
    const auto begin = Clock::now();
    const auto total = static_cast<std::uint64_t>(rate * seconds);
    std::uint64_t written = 0;
    while (written < total) {
      const double elapsed = std::chrono::duration<double>(Clock::now() - begin).count();
      const auto due = std::min(total, static_cast<std::uint64_t>(elapsed * rate));
      for (; written < due; ++written) {
        states.step(written);
        states.sim_time_ns(static_cast<std::int64_t>(written) * kPeriod);
        states_.write(states);
      }
      if (due < total) std::this_thread::sleep_for(200us);
    }
    return written;
  }

 private:
  double number() const { return static_cast<double>(step_); }

  PlantState make_plant_state(std::uint32_t id) const {
    PlantState state;
    state.p_WQ_m({0.01 * number(), 2.0 + id, -3.0});
    state.v_WQ_m_s({0.5, -0.25, 0.125});
    state.q_WB({1, 0, 0, 0});
    state.w_WB_B_rad_s({0.1, 0.2, 0.3});
    state.p_WL_m({0.01 * number(), 2.0 + id, -2.0});
    state.alpha_rad(0.001 * number());
    state.beta_rad(-0.001 * number());
    state.signals({4711.0});
    return state;
  }

  void write_status() {
    SimStatus status;
    status.run_id(run_id_);
    status.vehicle_id(vehicles_.front());
    status.sample_index(samples_++);
    status.phase(RunPhase::PHASE_RUNNING);
    status.step(step_);
    status.timing("real-time, 0 of 7 late");
    status.counters().resent(3);
    statuses_.write(status);
  }

  void write_commands() {
    Commands commands;
    commands.run_id(run_id_);
    commands.step(step_);
    commands.client_name("pilot");
    commands.strength(-5);
    for (const std::uint32_t id : list_first_vehicles())
      commands.vehicles().push_back(make_command(id));
    commands_.write(commands);
  }

  ControlCommand make_command(std::uint32_t id) const {
    ControlCommand command;
    command.vehicle_id(id);
    command.f_Q_W_n({1.5, -2.5, -16.0});
    command.reference().stage_name("hover");
    command.reference().position_m({0.01 * number(), 2.0, -2.0});
    return command;
  }

  /// The first vehicles, as many as fit into one sample of the loop.
  std::vector<std::uint32_t> list_first_vehicles() const {
    return {
        vehicles_.begin(),
        vehicles_.begin() + std::min<std::ptrdiff_t>(
                                SAMPLE_VEHICLES, static_cast<std::ptrdiff_t>(vehicles_.size()))};
  }

  /// Writes batches of about 12,000 bytes, as a server does.
  void write_record() {
    constexpr std::size_t kEntries = 16;
    RecordBatch batch;
    batch.run_id(run_id_);
    for (const std::uint32_t id : vehicles_) {
      batch.entries().push_back(make_entry(id));
      if (batch.entries().size() < kEntries && id != vehicles_.back()) continue;
      batch.batch_index(batch_++);
      records_.write(batch);
      batch.entries().clear();
    }
  }

  RecordEntry make_entry(std::uint32_t id) const {
    RecordEntry entry;
    entry.vehicle_id(id);
    entry.step(step_);
    entry.kind(AnswerKind::ANSWER_ACCEPTED);
    entry.truth(make_plant_state(id));
    entry.client_name("pilot");
    entry.answer(make_command(id));
    return entry;
  }

  bus::Node node_;
  bus::Writer<Parameters> parameters_{node_};
  bus::Writer<SimStatus> statuses_{node_};
  bus::Writer<States> states_{node_};
  bus::Writer<Commands> commands_{node_};
  bus::Writer<RecordBatch> records_{node_};
  bus::Writer<Participant> participants_{node_};
  bus::Writer<SimControl> controls_{node_};
  bus::Writer<SimControlReply> replies_{node_};
  std::uint64_t run_id_ = 0;
  std::vector<std::uint32_t> vehicles_;
  std::uint64_t step_ = 0;
  std::uint64_t batch_ = 0;
  std::uint64_t samples_ = 0;
};

/// The next line of stdin; "" if there is none within `limit`, nothing at the end of stdin.
std::optional<std::string> read_line(std::chrono::milliseconds limit) {
  static std::string pending;
  for (;;) {
    if (const auto end = pending.find('\n'); end != std::string::npos) {
      std::string line = pending.substr(0, end);
      pending.erase(0, end + 1);
      return line;
    }
    pollfd input{STDIN_FILENO, POLLIN, 0};
    if (poll(&input, 1, static_cast<int>(limit.count())) <= 0) return "";
    char bytes[256];
    const ssize_t count = read(STDIN_FILENO, bytes, sizeof bytes);
    if (count <= 0) return std::nullopt;
    pending.append(bytes, static_cast<std::size_t>(count));
  }
}

void publish(int domain) {
  constexpr std::uint64_t kFirstRun = 0x1111;
  Publisher publisher(domain);
  publisher.begin_run(kFirstRun, {0, 7});
  bool is_resting = false;
  while (const auto line = read_line(is_resting ? 100ms : 20ms)) {
    std::istringstream words(*line);
    std::string command;
    double number = 0, seconds = 0;
    words >> command >> number >> seconds;
    if (command == "reset") publisher.begin_run(kFirstRun + 1, {0, 9});
    if (command == "fleet") {
      std::vector<std::uint32_t> vehicles(static_cast<std::size_t>(number));
      std::iota(vehicles.begin(), vehicles.end(), 0U);
      publisher.begin_run(kFirstRun + 2, vehicles);
    }
    if (command == "rest") is_resting = true;
    if (command == "burst")
      std::cout << "{\"written\":" << publisher.burst(number, seconds) << "}" << std::endl;
    if (is_resting)
      publisher.write_latched();
    else
      publisher.write_step();
  }
}

}  // namespace

int main(int argc, char** argv) {
  const sls::test::OwnDomain domain;
  std::cout << "{\"domain\":" << domain.number() << "}" << std::endl;
  if (argc > 1 && std::strcmp(argv[1], "publish") == 0)
    publish(domain.number());
  else
    while (read_line(1000ms)) continue;
  return 0;
}
