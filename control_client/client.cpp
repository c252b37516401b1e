#include "control_client/client.hpp"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <cctype>
#include <thread>

#include "common/app/run_main.hpp"
#include "common/app/scheduling.hpp"
#include "common/app/wait.hpp"
#include "common/bus/convert.hpp"
#include "common/bus/spinning.hpp"
#include "common/config/vehicle_ids.hpp"
#include "common/plugin/shared_library.hpp"
#include "control_client/messages.hpp"

namespace sls::control {
namespace {

constexpr double kAfterThePatience_s = 5.0;  // so the run ends before a law that hangs

}  // namespace

std::string describe_name_defect(const std::string& name) {
  const bool is_plain = std::all_of(name.begin(), name.end(), [](unsigned char letter) {
    return std::isalnum(letter) || letter == '_' || letter == '-' || letter == '.';
  });
  if (!name.empty() && name.size() <= 32 && is_plain) return "";
  return "expected 1 to 32 letters, digits, '_', '-' or '.', got '" + name + "'";
}

Client::Client(bus::Node& node, const config::Scenario& scenario,
               const std::vector<std::uint32_t>& vehicle_ids, const ClientOptions& options)
    : node_(node),
      scenario_(scenario),
      options_(options),
      library_sha256_(
          plugin::find_loaded_sha256(scenario.controller.law.find_library(scenario.folder))),
      vehicle_ids_(vehicle_ids),
      servers_(node),
      announcer_(node),
      stream_(make_stream(scenario.sync.mode == config::SyncMode::kRealtime)) {
  answers_.client_name(options.name);
  answers_.strength(options.strength);
}

std::unique_ptr<AnswerStream> Client::make_stream(bool is_realtime) {
  return std::make_unique<AnswerStream>(
      node_, is_realtime,
      [this](const States& sample, const bus::PeerId& sender) { receive(sample, sender); });
}

void Client::run() {
  auto next = find_first_run();
  while (next) {
    begin(*next);
    next = serve();
  }
  if (run_) leave();
}

std::optional<sync::Run> Client::find_first_run() {
  const double timeout_s = scenario_.sync.wait_for.timeout_s;
  const std::string vehicles = config::to_vehicle_ranges(vehicle_ids_);
  app::Wait wait(timeout_s, app::kUsualJoinTime);
  announce_waiting();
  while (!options_.is_stopped()) {
    servers_.look_for_impostors();
    if (auto run = find_joinable_run()) return run;
    announcer_.repeat_if_due();
    if (wait.is_over())
      throw app::RunError(fmt::format("no server for vehicle {} within {} s{}{}", vehicles,
                                      timeout_s, describe_problem(), node_.describe_isolation()));
    if (wait.is_report_due())
      spdlog::info("waiting for: server of vehicle {} ({:.0f} s left){}{}", vehicles,
                   wait.seconds_left(), describe_problem(), node_.describe_isolation());
    std::this_thread::sleep_for(app::kShortPollTime);
  }
  return std::nullopt;
}

/// "; " and the problems of other participants on the domain, to be appended to a message about a
/// missing server. Empty without problems.
std::string Client::describe_problem() const {
  const std::string problem = node_.problems().describe();
  return problem.empty() ? "" : "; " + problem;
}

std::optional<sync::Run> Client::find_joinable_run() const {
  for (const std::uint32_t id : vehicle_ids_)
    if (auto run = servers_.find_joinable(id)) return run;
  return std::nullopt;
}

void Client::begin(const sync::Run& run) {
  const Parameters& parameters = run.parameters;
  if (!(parameters.scenario_sha256() == scenario_.sha256))
    throw config::ConfigError(
        fmt::format("scenario '{}': expected the server's, SHA-256 {}, got {}", scenario_.name,
                    parameters.scenario_sha256().c_str(), scenario_.sha256));
  const bool is_realtime = parameters.mode() == SyncMode::MODE_REALTIME;
  config::Scenario scenario = scenario_;
  scenario.sync.period_ns = parameters.period_ns();
  scenario.plant.step_ns = parameters.step_ns();
  std::map<std::uint32_t, Pilot> pilots;
  flown_ids_.clear();
  for (const std::uint32_t id : vehicle_ids_) {
    if (!sync::serves_vehicle(parameters, id)) continue;
    flown_ids_.push_back(id);
    pilots.try_emplace(id, config::make_vehicle_scenario(scenario, id), id, options_);
  }
  // Made and destroyed without the lock: both wait for running handlers, and our handler waits for
  // the lock.
  auto stream = stream_->is_realtime() == is_realtime ? nullptr : make_stream(is_realtime);
  {
    const std::lock_guard lock(answer_mutex_);
    run_ = run;
    scenario_ = std::move(scenario);
    pilots_ = std::move(pilots);
    if (stream) stream_.swap(stream);
  }
  if (is_realtime) {
    bus::stop_spinning();
    app::put_process_first();
  } else {
    bus::start_spinning();
  }
  plugin::set_patience(scenario_.sync.calc_controller_patience_s() + kAfterThePatience_s);
  ready_ = false;
  watch_.emplace(servers_, run, scenario_.sync.wait.server_deadline_s);
  const std::string vehicles =
      sync::is_fleet(parameters) ? ", vehicles " + config::to_vehicle_ranges(flown_ids_) : "";
  spdlog::info("'{}' joins run {:016x}: {}{}, period {} s", options_.name, parameters.run_id(),
               scenario_.name, vehicles, scenario_.sync.period_ns * 1e-9);
  announce(false, false);
}

void Client::leave() {
  bus::stop_spinning();
  const std::uint64_t run_id = run_->parameters.run_id();
  const auto status = servers_.find_status(run_id);
  announce(false, true);
  if (status && status->phase() == RunPhase::PHASE_FAILED)
    throw app::RunError(fmt::format("the run failed: {}", status->reason().c_str()));
}

std::optional<sync::Run> Client::serve() {
  while (!options_.is_stopped()) {
    rethrow_answer_error();
    if (has_ended()) return std::nullopt;
    servers_.look_for_impostors();
    if (auto next = find_successor()) return next;
    if (!ready_ && stream_->sees_server(run_->server)) {
      ready_ = true;
      announce(true, false);
    }
    announcer_.repeat_if_due();
    std::this_thread::sleep_for(app::kPollTime);
  }
  return std::nullopt;
}

void Client::receive(const States& sample, const bus::PeerId& sender) {
  const std::lock_guard lock(answer_mutex_);
  try {
    answer(sample, sender);
  } catch (...) {  // an exception must not reach the middleware
    answer_error_ = std::current_exception();
  }
}

void Client::answer(const States& sample, const bus::PeerId& sender) {
  if (!run_ || sample.run_id() != run_->parameters.run_id()) return;
  if (!(sender == run_->server)) return note_impostor(sender);
  answers_.run_id(sample.run_id());
  answers_.step(sample.step());
  answers_.vehicles().clear();
  for (const VehicleState& state : sample.vehicles()) {
    const auto pilot = pilots_.find(state.vehicle_id());
    if (pilot != pilots_.end())
      answers_.vehicles().push_back(answer(pilot->second, sample.step(), state));
  }
  if (!answers_.vehicles().empty()) stream_->write(answers_);
}

void Client::note_impostor(const bus::PeerId& sender) {
  if (impostor_ == sender) return;  // it may send many samples
  impostor_ = sender;
  servers_.note_impostor(sender, bus::Topic<States>::kName, run_->parameters.run_id(),
                         run_->server);
}

const ControlCommand& Client::answer(Pilot& pilot, std::uint64_t step, const VehicleState& state) {
  if (pilot.last_step == step) return pilot.last_command;
  const auto began = Clock::now();
  const Answer answer = pilot.controller.calc_answer(step, bus::to_measurement(state.measured()),
                                                     to_memory(state.controller()));
  const auto compute_time = Clock::now() - began;
  pilot.last_command = make_command_message(state.vehicle_id(), answer, compute_time);
  pilot.last_step = step;
  if (answer.fault != Fault::kNone)
    spdlog::error("step {}: fault {}", step, to_string(answer.fault));
  return pilot.last_command;
}

void Client::rethrow_answer_error() {
  const std::unique_lock lock(answer_mutex_, std::try_to_lock);
  if (lock && answer_error_) std::rethrow_exception(answer_error_);
}

bool Client::has_ended() const {
  const auto status = servers_.find_status(run_->parameters.run_id());
  return status &&
         (status->phase() == RunPhase::PHASE_FINISHED || status->phase() == RunPhase::PHASE_FAILED);
}

std::optional<sync::Run> Client::find_successor() {
  const auto finding = watch_->look();
  if (auto next = servers_.find_successor(*run_, flown_ids_)) {
    const bool is_reset = next->server == run_->server;
    const std::string news =
        fmt::format("run {:016x} was {} run {:016x}", run_->parameters.run_id(),
                    is_reset ? "reset to" : "replaced by", next->parameters.run_id());
    if (!is_reset && !options_.follows_servers) throw app::RunError(news + " (see --follow)");
    spdlog::warn("{}: following it", news);
    return next;
  }
  if (finding == sync::ServerWatch::Finding::kLost)
    throw app::RunError(fmt::format("the {}, expected it to finish", watch_->describe()));
  return std::nullopt;
}

void Client::announce_waiting() { announcer_.announce(make_announcement(vehicle_ids_)); }

void Client::announce(bool ready, bool done) {
  Participant message = make_announcement(flown_ids_);
  message.run_id(run_->parameters.run_id());
  message.ready(ready);
  message.done(done);
  announcer_.announce(message);
}

Participant Client::make_announcement(const std::vector<std::uint32_t>& vehicle_ids) const {
  Participant message;
  message.contract_sha256(bus::kContractSha256);
  message.vehicle_ids(vehicle_ids);
  message.role(ParticipantRole::ROLE_CONTROLLER);
  message.name(options_.name);
  message.host(bus::host_name());
  message.strength(options_.strength);
  message.scenario_sha256(scenario_.sha256);
  message.library_sha256(library_sha256_);
  message.last_complete_step(-1);
  return message;
}

}  // namespace sls::control
