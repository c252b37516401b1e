#include "worlds/client_program.hpp"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <exception>
#include <utility>

#include "worlds/mistakes.hpp"

namespace sls::worlds {
namespace {

using namespace std::chrono_literals;

control::ClientCore::Options make_core_options(const config::Scenario& scenario,
                                               const std::string& name, const std::string& host,
                                               const ClientProgram::Options& options) {
  control::ClientCore::Options made;
  made.vehicle_ids = options.vehicle_ids;
  made.identity.contract_sha256(bus::kContractSha256);
  made.identity.name(options.announced_name.empty() ? name : options.announced_name);
  made.identity.host(host);
  made.identity.strength(options.strength);
  made.identity.scenario_sha256(scenario.sha256);
  if (options.has_library) made.identity.library_sha256(std::string(64, '1'));
  made.join_timeout_s = scenario.sync.wait_for.timeout_s;
  made.server_deadline_s = scenario.sync.wait.server_deadline_s;
  made.follows_servers = options.follows_servers;
  return made;
}

config::Scenario choose_scenario(const Setting& setting, const ClientProgram::Options& options) {
  config::Scenario scenario = setting.flown->scenario;
  if (options.has_other_scenario) scenario.sha256 = std::string(64, '0');
  return scenario;
}

/// The same answers with other forces.
Commands make_wrong(const Commands& answers) {
  Commands wrong = answers;
  for (ControlCommand& command : wrong.vehicles()) command.f_Q_W_n()[0] += 1;
  return wrong;
}

}  // namespace

ClientProgram::ClientProgram(Setting& setting, Host& host, std::string name, const Options& options)
    : Program(setting, host, Role::kClient, std::move(name)),
      options_(options),
      scenario_(choose_scenario(setting, options)),
      core_(make_core_options(scenario_, this->name(), host.name(), options)) {}

void ClientProgram::start() {
  read<Parameters>();
  read<SimStatus>();
  peer_.add_writer<Participant>();
  peer_.add_writer<Commands>();
  peer_.add_reader<States>(
      [this](const States& sample, const Peer::Arrival& arrival) { on_states(sample, arrival); });
  setting_.network.announce(peer_);
  announce_state();
  wake_soon();
}

void ClientProgram::wake() {
  if (!broken_.empty()) return exit(1, broken_);
  control::ClientCore::Now seen;
  seen.time = now();
  seen.is_stopped = was_interrupted();
  if (answerer_) seen.sees_server = sees(answerer_->run().server);
  using Act = control::ClientCore::Act;
  const Act act = core_.look(present_servers(), seen);
  for (const sync::Line& line : core_.take_lines()) say(line);
  try {
    if (act == Act::kBegin) begin();
  } catch (const config::ConfigError& error) {
    return exit(2, error.what());
  }
  if (act == Act::kAnnounceReady || act == Act::kLeave) announce_state();
  if (!options_.announces_once) repeat_announcement_if_due();
  if (core_.phase() == control::ClientCore::Phase::kEnded)
    return exit(core_.error().empty() ? 0 : 1, core_.error());
  wake_at(core_.next_deadline());
}

void ClientProgram::begin() {
  answerer_ = std::make_unique<control::Answerer>(
      scenario_, *core_.run(), core_.list_flown_ids(),
      control::Answerer::Options{name(),
                                 options_.strength,
                                 false,
                                 options_.make_law,
                                 [this] { return now(); },
                                 [this](const std::string& line) { say(line); },
                                 {}});
  say(fmt::format("joins run {:016x}", core_.run()->parameters.run_id()));
  announce_state();
}

void ClientProgram::announce_state() {
  Participant message = core_.make_announcement();
  if (options_.says_done) message.done(message.ready());
  announce(message);
}

void ClientProgram::on_states(const States& sample, const Peer::Arrival& arrival) {
  if (!answerer_ || sample.run_id() != answerer_->run().parameters.run_id() ||
      !(arrival.sender == answerer_->run().server))
    return;
  try {
    const Commands* answers = answerer_->answer(sample);
    if (!answers) return;
    if (options_.compute_time.count() == 0) return send(*answers);
    process_.run_at(setting_.timeline.now() + options_.compute_time,
                    [this, copy = *answers] { send(copy); });
  } catch (const std::exception& error) {
    broken_ = error.what();
  }
}

void ClientProgram::send(const Commands& answers) {
  if (options_.breaks_at && answers.step() >= *options_.breaks_at && send_broken(answers)) return;
  if (options_.is_sloppy && setting_.random.chance(0.05)) send_wrongly(answers);
  peer_.write(answers);
  if (!options_.is_early) return;
  // Not at once: it must not overtake the answer.
  process_.run_at(setting_.timeline.now() + 500us, [this, early = make_wrong(answers)]() mutable {
    early.step(early.step() + 1);
    peer_.write(early);
  });
}

/// False if the mistake is over.
bool ClientProgram::send_broken(const Commands& answers) {
  const auto& mistakes = list_answer_mistakes();
  const AnswerMistake& mistake = mistakes[*options_.breaks_at % mistakes.size()];
  if (answers.step() - *options_.breaks_at >= mistake.steps) return false;
  Commands broken = answers;
  if (mistake.copies == 0) broken.vehicles().clear();
  for (int i = 0; i < std::max(mistake.copies, 1); ++i) {
    for (ControlCommand& command : broken.vehicles()) mistake.make(command, broken.step());
    // Not at once: a copy that is overtaken is dropped.
    process_.run_at(setting_.timeline.now() + i * 100us, [this, broken] { peer_.write(broken); });
  }
  return true;
}

void ClientProgram::send_wrongly(const Commands& answers) {
  const bool is_lockstep = setting_.flown->scenario.sync.mode == config::SyncMode::kLockstep;
  Commands wrong = make_wrong(answers);
  switch (setting_.random.integer(0, 3)) {
    case 0:
      wrong.run_id(answers.run_id() + 1);
      break;
    case 1:
      // In real time a late answer may be held, so a client can do harm to itself.
      wrong.step(answers.step() - (is_lockstep ? 1 : 1001));
      break;
    case 2:
      for (ControlCommand& command : wrong.vehicles()) command.vehicle_id(77);
      break;
    default:
      wrong.step(answers.step() + 1000);
  }
  peer_.write(wrong);
}

}  // namespace sls::worlds
