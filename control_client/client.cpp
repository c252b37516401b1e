#include "control_client/client.hpp"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <cctype>
#include <thread>

#include "common/app/log.hpp"
#include "common/app/run_main.hpp"
#include "common/app/scheduling.hpp"
#include "common/bus/convert.hpp"
#include "common/bus/spinning.hpp"
#include "common/config/vehicle_ids.hpp"
#include "common/plugin/shared_library.hpp"

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
      core_({vehicle_ids, scenario.sync.wait_for.timeout_s, scenario.sync.wait.server_deadline_s,
             options.follows_servers}),
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
  announce_waiting();
  for (act(look()); core_.phase() != ClientCore::Phase::kEnded; act(look())) {
    announcer_.repeat_if_due();
    std::this_thread::sleep_until(core_.next_deadline());
  }
  if (!core_.error().empty()) throw app::RunError(core_.error() + describe_obstacles());
}

void Client::act(ClientCore::Act act) {
  if (act == ClientCore::Act::kBegin) begin();
  if (act == ClientCore::Act::kAnnounceReady) announce(true, false);
  if (act == ClientCore::Act::kLeave) leave();
}

ClientCore::Act Client::look() {
  if (run_) rethrow_answer_error();
  servers_.look_for_impostors();
  const ClientCore::Now now{Clock::now(), options_.is_stopped(),
                            run_ && stream_->sees_server(run_->server)};
  const auto act =
      servers_.ask([&](const sync::Servers& servers) { return core_.look(servers, now); });
  for (const sync::Line& line : core_.take_lines())
    app::log({line.is_warning, line.text + describe_obstacles()});
  return act;
}

/// While no server is found, what may be in the way, to be appended to a message; else empty.
std::string Client::describe_obstacles() const {
  if (run_) return "";
  const std::string problem = node_.problems().describe();
  return (problem.empty() ? "" : "; " + problem) + node_.describe_isolation();
}

void Client::begin() {
  const sync::Run run = *core_.run();
  const Parameters& parameters = run.parameters;
  if (!(parameters.scenario_sha256() == scenario_.sha256))
    throw config::ConfigError(
        fmt::format("scenario '{}': expected the server's, SHA-256 {}, got {}", scenario_.name,
                    parameters.scenario_sha256().c_str(), scenario_.sha256));
  const bool is_realtime = parameters.mode() == SyncMode::MODE_REALTIME;
  config::Scenario scenario = scenario_;
  scenario.sync.period_ns = parameters.period_ns();
  scenario.plant.step_ns = parameters.step_ns();
  const std::vector<std::uint32_t> flown_ids = core_.list_flown_ids();
  std::map<std::uint32_t, Pilot> pilots;
  for (const std::uint32_t id : flown_ids)
    pilots.try_emplace(id, config::make_vehicle_scenario(scenario, id), id, options_);
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
  stream.reset();  // before the announcement: the server judges the endpoints of its participants
  if (is_realtime) {
    bus::stop_spinning();
    app::put_process_first();
  } else {
    bus::start_spinning();
  }
  plugin::set_patience(scenario_.sync.calc_controller_patience_s() + kAfterThePatience_s);
  const std::string vehicles =
      sync::is_fleet(parameters) ? ", vehicles " + config::to_vehicle_ranges(flown_ids) : "";
  spdlog::info("'{}' joins run {:016x}: {}{}, period {} s", options_.name, parameters.run_id(),
               scenario_.name, vehicles, scenario_.sync.period_ns * 1e-9);
  announce(false, false);
}

void Client::leave() {
  bus::stop_spinning();
  announce(false, true);
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
  model::Answer answer = pilot.controller.calc_answer(step, bus::to_measurement(state.measured()),
                                                      bus::to_memory(state.controller()));
  answer.compute_time = Clock::now() - began;
  bus::fill(pilot.last_command, state.vehicle_id(), answer);
  pilot.last_step = step;
  if (answer.error_code != ErrorCode::kNone)
    spdlog::error("step {}: fault {}", step, to_string(answer.error_code));
  return pilot.last_command;
}

void Client::rethrow_answer_error() {
  const std::unique_lock lock(answer_mutex_, std::try_to_lock);
  if (lock && answer_error_) std::rethrow_exception(answer_error_);
}

void Client::announce_waiting() { announcer_.announce(make_announcement(vehicle_ids_)); }

void Client::announce(bool ready, bool done) {
  Participant message = make_announcement(core_.list_flown_ids());
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
