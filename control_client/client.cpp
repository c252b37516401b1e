#include "control_client/client.hpp"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <cctype>

#include "common/app/log.hpp"
#include "common/app/run_error.hpp"
#include "common/app/scheduling.hpp"
#include "common/app/wait.hpp"
#include "common/bus/spinning.hpp"
#include "common/config/vehicle_ids.hpp"
#include "common/plugin/shared_library.hpp"

namespace sls::control {
namespace {

constexpr double kAfterThePatience_s = 5.0;  // so the run ends before a law that hangs

Participant make_identity(const config::Scenario& scenario, const ClientOptions& options) {
  Participant identity;
  identity.contract_sha256(bus::kContractSha256);
  identity.name(options.name);
  identity.host(bus::host_name());
  identity.strength(options.strength);
  identity.scenario_sha256(scenario.sha256);
  identity.library_sha256(
      plugin::find_loaded_sha256(scenario.controller.law.find_library(scenario.folder)));
  return identity;
}

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
      servers_(node),
      announcer_(node),
      core_({vehicle_ids, make_identity(scenario, options), scenario.sync.wait_for.timeout_s,
             scenario.sync.wait.server_deadline_s, options.follows_servers}),
      stream_(make_stream(scenario.sync.mode == config::SyncMode::kRealtime)) {}

std::unique_ptr<AnswerStream> Client::make_stream(bool is_realtime) {
  return std::make_unique<AnswerStream>(
      node_, is_realtime,
      [this](const States& sample, const bus::PeerId& sender) { receive(sample, sender); });
}

void Client::run() {
  announcer_.announce(core_.make_announcement());
  const app::LookedAfter until_the_end;
  for (act(look()); core_.phase() != ClientCore::Phase::kEnded; act(look())) {
    announcer_.repeat_if_due();
    app::sleep_until(core_.next_deadline());
  }
  if (!core_.error().empty()) throw app::RunError(core_.error() + describe_obstacles());
}

void Client::act(ClientCore::Act act) {
  if (act == ClientCore::Act::kBegin) begin();
  if (act == ClientCore::Act::kLeave) bus::stop_spinning();
  if (act == ClientCore::Act::kAnnounceReady || act == ClientCore::Act::kLeave)
    announcer_.announce(core_.make_announcement());
}

ClientCore::Act Client::look() {
  if (answerer_) rethrow_answer_error();
  servers_.look_for_impostors();
  const ClientCore::Now now{app::awake_clock().now(), options_.is_stopped(),
                            answerer_ && stream_->sees_server(answerer_->run().server)};
  const auto act =
      servers_.ask([&](const sync::Servers& servers) { return core_.look(servers, now); });
  for (const sync::Line& line : core_.take_lines())
    app::log({line.is_warning, line.text + describe_obstacles()});
  return act;
}

/// While no server is found, what may be in the way, to be appended to a message; else empty.
std::string Client::describe_obstacles() const {
  if (answerer_) return "";
  const std::string problem = node_.problems().describe();
  return (problem.empty() ? "" : "; " + problem) + node_.describe_isolation();
}

void Client::begin() {
  const std::vector<std::uint32_t> flown_ids = core_.list_flown_ids();
  const Parameters& parameters = core_.run()->parameters;
  const bool is_known = parameters.scenario_sha256() == scenario_.sha256;
  auto answerer = std::make_unique<Answerer>(
      scenario_, *core_.run(), flown_ids,
      Answerer::Options{options_.name, options_.strength, options_.checks_purity, options_.make_law,
                        &Clock::now, [](const std::string& line) { spdlog::error("{}", line); },
                        is_known ? "" : node_.describe_other_flight()});
  const bool is_realtime = parameters.mode() == SyncMode::MODE_REALTIME;
  // Made and destroyed without the lock: both wait for running handlers, and our handler waits for
  // the lock.
  auto stream = stream_->is_realtime() == is_realtime ? nullptr : make_stream(is_realtime);
  {
    const std::lock_guard lock(answer_mutex_);
    answerer_.swap(answerer);
    if (stream) stream_.swap(stream);
  }
  stream.reset();  // before the announcement: the server judges the endpoints of its participants
  if (is_realtime) {
    bus::stop_spinning();
    app::put_process_first();
  } else {
    bus::start_spinning();
  }
  const config::Sync& sync = answerer_->scenario().sync;
  plugin::set_patience(sync.calc_controller_patience_s() + kAfterThePatience_s);
  const std::string vehicles =
      sync::is_fleet(parameters) ? ", vehicles " + config::to_vehicle_ranges(flown_ids) : "";
  spdlog::info("'{}' joins run {:016x}: {}{}, period {} s", options_.name, parameters.run_id(),
               scenario_.name, vehicles, sync.period_ns * 1e-9);
  announcer_.announce(core_.make_announcement());
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
  if (!answerer_ || sample.run_id() != answerer_->run().parameters.run_id()) return;
  if (!(sender == answerer_->run().server)) return note_impostor(sender);
  if (const Commands* answers = answerer_->answer(sample)) stream_->write(*answers);
}

void Client::note_impostor(const bus::PeerId& sender) {
  if (impostor_ == sender) return;  // it may send many samples
  impostor_ = sender;
  const sync::Run& run = answerer_->run();
  servers_.note_impostor(sender, bus::Topic<States>::kName, run.parameters.run_id(), run.server);
}

void Client::rethrow_answer_error() {
  const std::unique_lock lock(answer_mutex_, std::try_to_lock);
  if (lock && answer_error_) std::rethrow_exception(answer_error_);
}

}  // namespace sls::control
