#include "control_client/client.hpp"

#include <spdlog/spdlog.h>

#include <thread>

#include "common/app/run_main.hpp"
#include "common/app/stop_signal.hpp"
#include "common/app/wait.hpp"
#include "control_client/messages.hpp"

namespace sls::control {
namespace {

using namespace std::chrono_literals;

constexpr auto kUsualJoinTime = 1500ms;      // a server's claim and discovery: no news
constexpr auto kAcknowledgmentTime = 500ms;  // for the last samples to reach the recorders
constexpr auto kPollTime = 20ms;             // while nothing is in a hurry

}  // namespace

Client::Client(bus::Node& node, const config::Scenario& scenario, const std::string& name,
               std::int32_t strength, bool follows_servers)
    : node_(node),
      scenario_(scenario),
      name_(name),
      strength_(strength),
      follows_servers_(follows_servers),
      participants_(node),
      servers_(node),
      participant_writer_(node),
      reference_writer_(node),
      state_reader_(node, bus::kLoopReaderProfile,
                    [this](const VehicleState& state, const bus::PeerId& sender) {
                      receive(state, sender);
                    }) {}

void Client::run() {
  auto next = find_first_run();
  while (next) {
    begin(*next);
    next = serve();
  }
  if (run_) leave();
}

std::optional<bus::Run> Client::find_first_run() {
  const double timeout_s = scenario_.sync.wait_for.timeout_s;
  app::Wait wait(timeout_s, kUsualJoinTime);
  while (app::stop_signal() == 0) {
    if (auto run = servers_.find_joinable(vehicle_id_)) return run;
    if (wait.is_over())
      throw app::RunError(fmt::format("no server for vehicle {} within {} s{}", vehicle_id_,
                                      timeout_s, node_.describe_loneliness()));
    if (wait.is_report_due())
      spdlog::info("waiting for: server of vehicle {} ({:.0f} s left){}", vehicle_id_,
                   wait.seconds_left(), node_.describe_loneliness());
    std::this_thread::sleep_for(kPollTime);
  }
  return std::nullopt;
}

void Client::begin(const bus::Run& run) {
  const Parameters& parameters = run.parameters;
  if (!(parameters.scenario_sha256() == scenario_.sha256))
    throw config::ConfigError(
        fmt::format("scenario '{}': expected the server's, SHA-256 {}, got {}", scenario_.name,
                    parameters.scenario_sha256().c_str(), scenario_.sha256));
  const char* profile = parameters.mode() == MODE_REALTIME
                            ? node_.choose_writer_profile(bus::kRealtimeCommandWriterProfile,
                                                          bus::kStreamWriterProfile)
                            : bus::kStreamWriterProfile;
  // Made and destroyed outside the lock: the middleware waits for handlers meanwhile, and ours for
  // the lock.
  auto writer = profile == command_profile_
                    ? nullptr
                    : std::make_unique<bus::Writer<ControlCommand>>(node_, profile);
  command_profile_ = profile;
  {
    const std::lock_guard lock(answer_mutex_);
    run_ = run;
    scenario_.sync.period_ns = parameters.period_ns();
    scenario_.plant.step_ns = parameters.step_ns();
    controller_ = std::make_unique<FlightController>(scenario_);
    last_command_.reset();
    if (writer) command_writer_.swap(writer);
  }
  ready_ = false;
  watch_.emplace(servers_, run, scenario_.sync.wait.server_deadline_s);
  spdlog::info("'{}' joins run {:016x}: {}, period {} s", name_, parameters.run_id(),
               scenario_.name, scenario_.sync.period_ns * 1e-9);
  announce(false, false);
}

void Client::leave() {
  const std::uint64_t run_id = run_->parameters.run_id();
  const auto status = servers_.find_status(run_id);
  const bool is_finished = status && status->phase() == PHASE_FINISHED;
  announce(false, true);
  command_writer_->wait_for_acknowledgments(kAcknowledgmentTime);
  reference_writer_.wait_for_acknowledgments(kAcknowledgmentTime);
  if (app::stop_signal() == 0)
    bus::wait_for_recorders_to_end(participants_, run_id,
                                   is_finished ? scenario_.sync.wait_for.recorders : 0);
  if (status && status->phase() == PHASE_FAILED)
    throw app::RunError(fmt::format("the run failed: {}", status->reason().c_str()));
}

bool Client::sees_all_endpoints() const {
  if (state_reader_.matched().count(run_->server) == 0) return false;
  const auto command_readers = command_writer_->matched();
  const auto reference_readers = reference_writer_.matched();
  if (command_readers.count(run_->server) == 0) return false;
  int recorders = 0;
  for (const auto& entry : participants_.find(ROLE_RECORDER, run_->parameters.run_id()))
    if (command_readers.count(entry.peer) > 0 && reference_readers.count(entry.peer) > 0)
      ++recorders;
  return recorders >= scenario_.sync.wait_for.recorders;
}

std::optional<bus::Run> Client::serve() {
  while (app::stop_signal() == 0) {
    rethrow_answer_error();
    if (has_ended()) return std::nullopt;
    if (auto next = find_successor()) return next;
    if (!ready_ && sees_all_endpoints()) {
      ready_ = true;
      announce(true, false);
    }
    std::this_thread::sleep_for(kPollTime);
  }
  return std::nullopt;
}

void Client::receive(const VehicleState& state, const bus::PeerId& sender) {
  try {
    answer(state, sender);
  } catch (...) {  // an exception must not reach the middleware
    const std::lock_guard lock(answer_mutex_);
    answer_error_ = std::current_exception();
  }
}

void Client::answer(const VehicleState& state, const bus::PeerId& sender) {
  const std::lock_guard lock(answer_mutex_);
  const bool is_ours = run_ && sender == run_->server &&
                       state.run_id() == run_->parameters.run_id() &&
                       state.vehicle_id() == vehicle_id_;
  if (!is_ours) return;
  if (last_command_ && last_command_->step() == state.step()) {
    command_writer_->write(*last_command_);
    return;
  }
  const auto began = Clock::now();
  const Answer answer =
      controller_->calc_answer(state.step(), to_model_state(state), to_memory(state.controller()));
  const auto compute_time = Clock::now() - began;
  last_command_ = make_command_message(state, answer, name_, strength_, compute_time);
  // The reference first: once the command is out the server moves on, and a client that is killed
  // then must not have kept back what a recorder needs of this step.
  reference_writer_.write(make_reference_message(state, answer, name_));
  command_writer_->write(*last_command_);
  if (answer.fault != Fault::kNone)
    spdlog::error("step {}: fault {}", state.step(), to_string(answer.fault));
}

void Client::rethrow_answer_error() {
  const std::lock_guard lock(answer_mutex_);
  if (answer_error_) std::rethrow_exception(answer_error_);
}

bool Client::has_ended() const {
  const auto status = servers_.find_status(run_->parameters.run_id());
  return status && (status->phase() == PHASE_FINISHED || status->phase() == PHASE_FAILED);
}

std::optional<bus::Run> Client::find_successor() {
  const auto finding = watch_->look();
  const auto next = servers_.find_joinable(vehicle_id_);
  if (next && next->parameters.run_id() != run_->parameters.run_id()) {
    const bool is_reset = next->server == run_->server;
    const bool is_replaced = servers_.is_silent(run_->parameters.run_id());
    const std::string news =
        fmt::format("run {:016x} was {} run {:016x}", run_->parameters.run_id(),
                    is_reset ? "reset to" : "replaced by", next->parameters.run_id());
    if (is_reset || (follows_servers_ && is_replaced)) {
      spdlog::warn("{}: follows it", news);
      return next;
    }
    if (is_replaced) throw app::RunError(news + " (see --follow)");
  }
  if (finding == bus::ServerWatch::Finding::kLost)
    throw app::RunError(fmt::format("the {}, expected it to finish", watch_->describe()));
  return std::nullopt;
}

void Client::announce(bool ready, bool done) {
  Participant message;
  message.run_id(run_->parameters.run_id());
  message.vehicle_id(vehicle_id_);
  message.role(ROLE_CONTROLLER);
  message.name(name_);
  message.host(bus::host_name());
  message.strength(strength_);
  message.scenario_sha256(scenario_.sha256);
  message.ready(ready);
  message.done(done);
  {
    const std::lock_guard lock(answer_mutex_);
    message.last_complete_step(last_command_ ? static_cast<std::int64_t>(last_command_->step())
                                             : -1);
  }
  participant_writer_.write(message);
}

}  // namespace sls::control
