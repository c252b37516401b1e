#include "sim_server/server.hpp"

#include <spdlog/spdlog.h>

#include <csignal>
#include <random>
#include <thread>

#include "common/app/options.hpp"
#include "common/app/run_main.hpp"
#include "common/app/stop_signal.hpp"
#include "common/bus/convert.hpp"
#include "common/bus/names.hpp"
#include "sim_server/slung_load_plant.hpp"

namespace sls::sim {
namespace {

using namespace std::chrono_literals;

constexpr auto kClaimTime = 1s;      // how long a claim on the vehicles is open to objection
constexpr auto kStatusTime = 500ms;  // between two status samples of a running flight
constexpr auto kRosterTime = 100ms;  // until a silent departure is looked for
constexpr auto kPollTime = 20ms;     // while nothing is in a hurry
constexpr std::size_t kMailboxSize = 4096;

std::uint64_t make_run_id() {
  std::random_device random;
  std::uint64_t id = 0;
  while (id == 0) id = (static_cast<std::uint64_t>(random()) << 32) | random();
  return id;
}

double to_seconds(std::chrono::steady_clock::duration duration) {
  return std::chrono::duration<double>(duration).count();
}

}  // namespace

Server::Server(bus::Node& node, const config::Scenario& scenario)
    : scenario_(scenario),
      run_id_(make_run_id()),
      participants_(node),
      servers_(node),
      state_writer_(node),
      parameters_writer_(node),
      status_writer_(node),
      commands_(kMailboxSize),
      command_reader_(node, bus::kLoopReaderProfile,
                      [this](const ControlCommand& command, const bus::PeerId& sender) {
                        commands_.put({command, sender});
                      }),
      gate_(run_id_, vehicle_id_, scenario.controller.force_limit_n) {}

void Server::run() {
  try {
    claim_vehicle();
    wait_for_participants();
    fly();
  } catch (const std::exception& error) {
    // Before the claim is settled nobody has joined, and there is nobody to tell.
    if (status_samples_ > 0) {
      publish_status(PHASE_FAILED, error.what());
      linger();
    }
    throw app::RunError(error.what());
  }
  linger();
}

void Server::claim_vehicle() {
  parameters_writer_.write(
      make_parameters_message(run_id_, vehicle_id_, scenario_, app::version()));
  spdlog::info("run {:016x}: {}, vehicle {}, lockstep, period {} s, step {} s", run_id_,
               scenario_.name, vehicle_id_, scenario_.sync.period_ns * 1e-9,
               scenario_.plant.step_ns * 1e-9);
  const auto settled = Clock::now() + kClaimTime;
  while (Clock::now() < settled) {
    check_stop();
    check_claim();
    std::this_thread::sleep_for(kPollTime);
  }
}

void Server::check_claim() const {
  std::optional<SimStatus> own;
  if (status_samples_ > 0) {
    own.emplace();
    own->phase(phase_);
  }
  const int progress = bus::calc_progress(own);
  for (const bus::Run& other : servers_.runs()) {
    const int others = bus::calc_progress(other.status);
    if (others < 0 || !bus::serves_vehicle(other.parameters, vehicle_id_)) continue;
    if (others > progress || (others == progress && other.parameters.run_id() < run_id_))
      throw app::RunError(
          fmt::format("vehicle {}: expected no other server on this domain, got one (run {:016x})",
                      vehicle_id_, other.parameters.run_id()));
  }
}

void Server::check_stop() const {
  if (app::stop_signal() != 0)
    throw app::RunError(
        fmt::format("interrupted by {}", app::stop_signal() == SIGINT ? "SIGINT" : "SIGTERM"));
}

Roster Server::find_roster() const {
  return {participants_.find(ROLE_CONTROLLER, run_id_), participants_.find(ROLE_RECORDER, run_id_)};
}

void Server::wait_for_participants() {
  const auto& expected = scenario_.sync.wait_for;
  app::Wait wait(expected.timeout_s);
  std::string published;
  publish_status(PHASE_WAITING, "participants are not ready");
  while (true) {
    check_stop();
    check_claim();
    const std::string missing = name_missing(find_roster(), expected, scenario_.sha256);
    if (missing.empty()) return;
    if (wait.is_over())
      throw app::RunError(fmt::format("not ready within {} s: {}", expected.timeout_s, missing));
    if (wait.is_report_due()) {
      spdlog::info("waiting for: {} ({:.0f} s left)", missing, wait.seconds_left());
      if (missing != published) publish_status(PHASE_WAITING, "missing: " + missing);
      published = missing;
    }
    std::this_thread::sleep_for(kPollTime);
  }
}

void Server::fly() {
  SlungLoadPlant plant(scenario_.vehicle, scenario_.plant);
  const auto steps_per_period = scenario_.sync.period_ns / scenario_.plant.step_ns;
  refresh_clients();
  start_time_ = Clock::now();
  publish_status(PHASE_RUNNING, "");
  Applied applied;
  for (;; ++step_) {
    wait_for_recorders(step_);
    const VehicleState state = make_state_message(run_id_, vehicle_id_, step_,
                                                  scenario_.sync.period_ns, plant.state(), applied);
    const ControlCommand answer = exchange(state);
    controller_name_ = answer.client_name().to_string();
    if (answer.mission() == MISSION_FINISHED) break;  // its force is not applied
    applied.f_Q_W = bus::to_vector(answer.f_Q_W_n());
    applied.controller_name = controller_name_;
    applied.memory = answer.controller();
    for (std::int64_t i = 0; i < steps_per_period; ++i) plant.step(applied.f_Q_W);
    publish_status_now_and_then();
  }
  const double wall_s = to_seconds(Clock::now() - start_time_);
  publish_status(PHASE_FINISHED, "mission finished");
  spdlog::info("finished: {} steps, {} s simulated in {:.2f} s, {:.0f} steps/s, {} resent", step_,
               static_cast<double>(step_) * scenario_.sync.period_ns * 1e-9, wall_s,
               static_cast<double>(step_) / wall_s, gate_.counters().resent());
}

ControlCommand Server::exchange(const VehicleState& state) {
  gate_.expect(state.step());
  const auto first_sent = Clock::now();
  state_writer_.write(state);
  auto resend_at = first_sent + timer_.timeout();
  std::optional<LateAnswer> late;  // most answers come before the first resend
  while (!gate_.accepted()) {
    if (const auto received = commands_.take(resend_at)) judge(*received);
    if (const auto refusal = gate_.refusal()) throw app::RunError(*refusal);
    if (gate_.accepted() || Clock::now() < resend_at) continue;

    state_writer_.write(state);
    ++gate_.counters().resent();
    timer_.resent();
    resend_at = Clock::now() + timer_.timeout();
    if (!late) late.emplace(first_sent, scenario_.sync);
    attend_to_late_answer(state.step(), *late);
  }
  timer_.answered(Clock::now() - first_sent);
  return *gate_.accepted();
}

void Server::attend_to_late_answer(std::uint64_t step, LateAnswer& late) {
  check_stop();
  refresh_clients();
  publish_status_now_and_then();
  const auto awaited = gate_.awaited_client();
  const auto now = Clock::now();
  if (awaited && now >= late.take_over_at && gate_.pass_over_silent_client()) {
    spdlog::warn("controller '{}' is silent at step {}: '{}' takes over", awaited->name, step,
                 gate_.awaited_client()->name);
    late.take_over_at = now + late.take_over_time;
  }
  const std::string waiting =
      awaited ? fmt::format("controller '{}'", awaited->name) : "controller (gone)";
  report_stall(step, waiting, late.wait);
}

void Server::report_stall(std::uint64_t step, const std::string& waiting, app::Wait& wait) {
  if (wait.is_over())
    throw app::RunError(fmt::format("step {}: waited {} s for {}", step,
                                    scenario_.sync.wait_for.timeout_s, waiting));
  if (!wait.is_report_due()) return;
  spdlog::warn("step {}: waiting for: {} ({:.0f} s left)", step, waiting, wait.seconds_left());
  publish_status(PHASE_RUNNING, "waiting for: " + waiting);
}

void Server::judge(const Received& received) {
  const Verdict verdict = gate_.offer(received.command, received.sender);
  const char* defect = to_string(verdict);
  if (*defect != '\0')
    spdlog::debug("command for step {} from '{}' rejected: {}", received.command.step(),
                  received.command.client_name().c_str(), defect);
}

void Server::wait_for_recorders(std::uint64_t step) {
  if (Clock::now() - roster_time_ > kRosterTime || participants_.version() != roster_version_)
    refresh_clients();
  std::optional<app::Wait> wait;
  while (true) {
    const std::string blocking =
        name_blocking_recorder(roster_, scenario_.sync.wait_for.recorders, step);
    if (blocking.empty()) return;
    check_stop();
    if (!wait) wait.emplace(scenario_.sync.wait_for.timeout_s);
    report_stall(step, blocking, *wait);
    std::this_thread::sleep_for(1ms);
    refresh_clients();
  }
}

void Server::refresh_clients() {
  roster_version_ = participants_.version();
  roster_time_ = Clock::now();
  roster_ = find_roster();
  gate_.set_clients(find_ready_clients(roster_, scenario_.sha256));
}

void Server::linger() {
  state_writer_.wait_for_acknowledgments(1s);
  status_writer_.wait_for_acknowledgments(1s);
  bus::wait_for_recorders_to_end(participants_, run_id_);
}

double Server::calc_real_time_factor() const {
  const double wall_s = to_seconds(Clock::now() - start_time_);
  const bool started = start_time_ != Clock::time_point{} && wall_s > 0;
  return started ? static_cast<double>(step_) * scenario_.sync.period_ns * 1e-9 / wall_s : 0.0;
}

void Server::publish_status(RunPhase phase, const std::string& reason) {
  phase_ = phase;
  status_time_ = Clock::now();
  SimStatus message;
  message.run_id(run_id_);
  message.vehicle_id(vehicle_id_);
  message.sample_index(status_samples_++);
  message.phase(phase);
  message.reason(reason);
  message.step(step_);
  message.controller_name(controller_name_);
  message.real_time_factor(calc_real_time_factor());
  message.counters(gate_.counters());
  status_writer_.write(message);
}

void Server::publish_status_now_and_then() {
  if (Clock::now() - status_time_ < kStatusTime) return;
  check_stop();
  check_claim();
  publish_status(PHASE_RUNNING, "");
}

}  // namespace sls::sim
