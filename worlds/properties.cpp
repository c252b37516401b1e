#include "worlds/properties.hpp"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cstring>
#include <utility>

#include "closed_loop/loss.hpp"
#include "worlds/client_program.hpp"
#include "worlds/recorder_program.hpp"
#include "worlds/server_program.hpp"

namespace sls::worlds {
namespace {

using namespace std::chrono_literals;

/// A missing participant is named after 1 s; a status is due every 0.5 s; the rest is for slow
/// processors.
constexpr Instant kNamedWithin = 2500ms;
/// Two servers of one vehicle that hear each other: one of them has gone after this.
constexpr Instant kRivalsGoneWithin = 3s;

/// A killed program is presumed dead after 2 s, and looked for ten times a second.
constexpr Instant kGoneAfter = 2500ms;
/// A server that is heard later than this is called silent after another half of it.
constexpr Instant kQuietTime = 900ms;
/// Discovery of the endpoints, and the announcement itself.
constexpr Instant kBeginsWithin = 60ms;
/// The others have heard of it, unless something is in the way.
constexpr Instant kHeardWithin = 2s;
/// The same over links that lose most: statuses come in their order.
constexpr Instant kKnownWithin = 10s;
/// Bytes of a reason or problem in a status (idl/sls.idl); a longer one ends with "..." there.
constexpr std::size_t kMostText = 255;
/// A program is known to repeat its announcement.
constexpr Instant kRepeatsWithin = 3s;
/// Time for which a server in real time asks for the last answers (sim::RealtimePacing).
constexpr Instant kLastAttempts = 1s;

/// A server waits longer than this for recorders that do not get on.
constexpr Instant kWaitsFor = 5s;

/// A server waits at most 1 s for acknowledgements of each of two topics.
constexpr Instant kEndsWithin = 3500ms;

void mix_vector(std::uint64_t& hash, const Eigen::Vector3d& vector) {
  for (int i = 0; i < 3; ++i) {
    std::uint64_t bits = 0;
    std::memcpy(&bits, &vector[i], sizeof bits);
    mix(hash, bits);
  }
}

/// A program that comes after the flight finds nothing.
bool has_joined(const Program& program) {
  if (program.role() == Role::kClient)
    return static_cast<const ClientProgram&>(program).has_flown();
  if (program.role() == Role::kRecorder)
    return static_cast<const RecorderProgram&>(program).has_recorded();
  return program.role() == Role::kServer;
}

}  // namespace

std::uint64_t hash_row(const model::StepRecord& record) {
  std::uint64_t hash = kEmptyHash;
  mix(hash, record.step);
  mix_vector(hash, record.truth.p_WQ);
  mix_vector(hash, record.truth.v_WQ);
  mix_vector(hash, record.truth.p_WL);
  mix_vector(hash, record.truth.v_WL);
  mix_vector(hash, record.f_Q_W);
  return hash;
}

std::uint64_t hash_answer(const model::StepRecord& record) {
  std::uint64_t hash = kEmptyHash;
  mix(hash, static_cast<std::uint64_t>(record.kind));
  mix(hash, record.answered_step);
  mix(hash, std::hash<std::string>()(record.client_name));
  mix_vector(hash, record.answer.f_Q_W);
  return hash;
}

void Properties::find(std::string finding) {
  trace_.add(timeline_.now(), "FOUND", finding);
  findings_.push_back(std::move(finding));
}

bool Properties::is_any_finished() const {
  return std::any_of(runs_.begin(), runs_.end(),
                     [](const auto& item) { return item.second.is_finished; });
}

std::vector<FlightSummary> Properties::summarise_flights() const {
  std::vector<FlightSummary> summaries;
  for (const auto& [run_id, run] : runs_)
    if (run.is_finished) summaries.push_back(run.summary);
  return summaries;
}

// --- during the world ----------------------------------------------------------------------------

void Properties::on_run(const Program& server, std::uint64_t run_id, const Parameters& parameters,
                        const config::Scenario& scenario) {
  Run& run = runs_[run_id];
  run.vehicle_ids = sync::list_vehicle_ids(parameters);
  run.flight = std::make_unique<FlightWatch>(scenario, run_id, run.vehicle_ids, server,
                                             [this](std::string text) { find(std::move(text)); });
  for (const auto& [before_id, before] : runs_)
    if (before.server == &server) run.flight->follow(*before.flight);
  run.scenario_sha256 = scenario.sha256;
  run.is_realtime = scenario.sync.mode == config::SyncMode::kRealtime;
  run.waits_for_recorders = scenario.sync.mode == config::SyncMode::kLockstep &&
                            scenario.sync.wait.recorder.policy == config::RecorderPolicy::kWait;
  run.has_faulty_forces =
      std::any_of(scenario.faults.begin(), scenario.faults.end(),
                  [](const auto& fault) { return fault.on == config::FaultChannel::kCommand; });
  run.phase_since = timeline_.now();
  run.server = &server;
}

void Properties::on_yielded(const Program& server, std::uint64_t run_id, const Network& network) {
  const Run& own = runs_[run_id];
  const auto has_won = [&](const auto& item) {
    const auto& [id, other] = item;
    if (other.server == &server || other.server->process().was_killed()) return false;
    // Others may not have heard of the last change.
    const auto progress = [&](const Run& run) {
      return run.has_status ? sync::calc_progress(run.phase) : 0;
    };
    const auto has_changed = [&](const Run& run) {
      return run.has_status && timeline_.now() - run.phase_since < kKnownWithin;
    };
    if (has_changed(other)) return true;
    // If its goodbye is lost, others keep its last known phase until its lease expires.
    const bool is_end_unknown = network.has_missed_leave(server.id(), other.server->id());
    if (has_changed(own)) return is_end_unknown || !other.has_ended;
    const int others_progress = is_end_unknown ? other.furthest : progress(other);
    return others_progress > progress(own) || (others_progress == progress(own) && id < run_id);
  };
  if (std::none_of(runs_.begin(), runs_.end(), has_won) && killed_.empty())
    find(fmt::format(
        "yields: {} yields, but no other server of its vehicles is in a later phase, or in the "
        "same one with a lower run id",
        server.name()));
}

void Properties::on_published(std::uint64_t run_id, std::uint64_t step,
                              const config::WaitFor& expected) {
  Run& run = runs_[run_id];
  const auto ready = static_cast<int>(run.ready.size());
  // A recorder that dies during a pause before the first step was there when all were ready.
  const int recorders =
      run.was_paused ? static_cast<int>(run.recorders.size()) : count_living(run, run.recorders);
  if (step == 0 && (ready < expected.controllers || recorders < expected.recorders))
    find(fmt::format("start: run {:016x} begins with {} controllers and {} recorders", run_id,
                     ready, recorders));
  run.flight->on_published(step, timeline_.now());
  if (step > 0) check_recorders(run, step, expected);
  run.published = timeline_.now();
  if (!run.began) run.began = run.published;
  run.is_stall_found = false;
}

void Properties::on_recorded(std::uint64_t run_id, const std::vector<model::StepRecord>& records) {
  Run& run = runs_[run_id];
  run.flight->on_recorded(records, timeline_.now());
  for (const model::StepRecord& record : records) {
    ++steps_;
    auto& rows = run.rows[record.vehicle_id];
    if (rows.size() != record.step)
      find(fmt::format("order: run {:016x} records step {} of vehicle {}, expected {}", run_id,
                       record.step, record.vehicle_id, rows.size()));
    rows.push_back(hash_row(record));
    run.answers[record.vehicle_id].push_back(hash_answer(record));
    const auto before = run.last.find(record.vehicle_id);
    if (before != run.last.end() && !run.has_faulty_forces) check_applied(before->second, record);
    run.last[record.vehicle_id] = record;
    run.is_exact = run.is_exact && (record.kind == model::AnswerKind::kAccepted ||
                                    record.kind == model::AnswerKind::kRefused ||
                                    record.kind == model::AnswerKind::kNone);
    if (record.kind != model::AnswerKind::kAccepted) continue;
    run.has_mistakes = run.has_mistakes || run.wrong.count(record.client_name) > 0;
    run.summary.worst_error_m =
        std::max(run.summary.worst_error_m, closed_loop::calc_load_error(record));
    if (record.answered_step != record.step)
      find(fmt::format("answer: step {} has the answer to step {}", record.step,
                       record.answered_step));
    if (run.ready.count(record.client_name) == 0)
      find(fmt::format("answer: step {} has an answer of '{}', which was not ready", record.step,
                       record.client_name));
    const auto killed = killed_.find(record.client_name);
    if (killed != killed_.end() && killed->second < run.published)
      find(fmt::format("answer: step {} has an answer of '{}', which was dead", record.step,
                       record.client_name));
  }
}

/// The force that acts is that of the answer.
void Properties::check_applied(const model::StepRecord& before, const model::StepRecord& record) {
  const bool is_answered =
      before.kind == model::AnswerKind::kAccepted || before.kind == model::AnswerKind::kHeld;
  if (is_answered && before.answer.f_Q_W != record.f_Q_W)
    find(fmt::format("answer: the force of step {} is not that of its answer", before.step));
}

void Properties::on_status(const SimStatus& status, const Network& network) {
  Run& run = runs_[status.run_id()];
  run.flight->on_status(status);
  check_problem(status);
  run.timing = status.timing().to_string();
  if (!run.has_status || run.phase != status.phase()) run.phase_since = timeline_.now();
  run.has_status = true;
  run.was_paused = run.was_paused || status.phase() == RunPhase::PHASE_PAUSED;
  run.phase = status.phase();
  run.furthest = std::max(run.furthest, sync::calc_progress(run.phase));
  run.summary.take_overs = status.counters().take_overs();
  run.summary.late = status.counters().held() + status.counters().fail_safe();
  if (status.reason().size() > 0) run.named = timeline_.now();
  if (sync::calc_progress(run.phase) > 0) check_rivals(run, network);
  if (run.phase != RunPhase::PHASE_RUNNING) return;
  run.flight->on_running(timeline_.now());
  check_stall(run, status.run_id());
}

/// No program is accused of a mistake that it does not make.
void Properties::check_problem(const SimStatus& status) {
  const std::string text = status.problem().to_string();
  for (std::size_t begin = 0; begin < text.size();) {
    const std::size_t end = std::min(text.size(), text.find("; ", begin));
    const std::string problem = text.substr(begin, end - begin);
    const bool is_whole = end < text.size() || text.size() < kMostText;
    begin = end + 2;
    const auto holds = [&](const char* part) { return problem.find(part) != problem.npos; };
    const std::size_t quote = problem.find('\'');
    if (!is_whole || quote == problem.npos) continue;
    const std::string name = problem.substr(quote + 1, problem.find('\'', quote + 1) - quote - 1);
    const auto known = announced_.find(name);
    if (known == announced_.end() || !known->second.is_honest) continue;
    // One that falls silent before it repeats its announcement may be one that need not.
    const auto is_soon = [&, since = known->second.since](const auto& times) {
      const auto time = times.find(name);
      return time != times.end() && time->second - since < kRepeatsWithin;
    };
    if (is_soon(killed_) || is_soon(stopped_)) continue;
    // Clocks of two hosts differ, or jump while a sample waits. The first client decides on
    // libraries. A client may wait for, or fly for, another server.
    const Host& host = runs_.at(status.run_id()).server->process().host();
    const bool is_true =
        (holds("source timestamp") &&
         (host.has_jumped() || !holds((" on " + host.name() + ":").c_str()))) ||
        (holds("library_sha256") && has_libraries_) ||
        (holds("run_id: ") && is_of_other_run(problem.substr(problem.rfind("got ") + 4), status));
    if (!is_true) find(fmt::format("accuses: {}", problem));
  }
}

/// `run_id`: in hexadecimal digits.
bool Properties::is_of_other_run(const std::string& run_id, const SimStatus& status) const {
  return std::any_of(runs_.begin(), runs_.end(), [&](const auto& run) {
    return run.first != status.run_id() && fmt::format("{:016x}", run.first) == run_id;
  });
}

/// Those that the server may presume alive: it need not know of a recent death, and the last
/// message of a killed one may have waited for a server that was stopped.
int Properties::count_living(const Run& run, const std::set<std::string>& names) const {
  return static_cast<int>(std::count_if(names.begin(), names.end(), [&](const auto& name) {
    const auto killed = killed_.find(name);
    if (killed == killed_.end()) return true;
    const Instant heard = run.flight->find_heard(name);
    return timeline_.now() - std::max({killed->second, run.disturbed, heard}) < kGoneAfter;
  }));
}

/// In lockstep a flight waits for the recorders that it expects.
void Properties::check_recorders(const Run& run, std::uint64_t step,
                                 const config::WaitFor& expected) {
  if (run.waits_for_recorders && count_living(run, run.recorders) < expected.recorders)
    find(fmt::format("recorders: step {} leaves without them", step));
}

/// A participant that keeps others waiting is named.
void Properties::check_stall(Run& run, std::uint64_t run_id) {
  if (!run.published || run.is_stall_found || run.server->is_slow()) return;
  const Instant since = std::max(*run.published, run.disturbed);
  if (timeline_.now() - since < kNamedWithin || run.named >= *run.published) return;
  run.is_stall_found = true;
  find(fmt::format("named: run {:016x} stands still since {:.3f} s, and nobody is named", run_id,
                   sync::to_seconds(since)));
}

void Properties::check_rivals(const Run& run, const Network& network) {
  for (const auto& [id, other] : runs_) {
    if (&other == &run || other.has_ended || !other.has_status) continue;
    const bool share = std::any_of(run.vehicle_ids.begin(), run.vehicle_ids.end(),
                                   [&ids = other.vehicle_ids](std::uint32_t vehicle) {
                                     return std::count(ids.begin(), ids.end(), vehicle) > 0;
                                   });
    const auto key = std::minmax(run.server, other.server);
    const bool meet = share && other.server != run.server && !other.server->process().has_ended() &&
                      !other.server->process().is_stopped() &&
                      network.find_connected_since(run.server->id(), other.server->id());
    if (!meet) {
      rivals_.erase(key);
      continue;
    }
    const Instant since = rivals_.try_emplace(key, timeline_.now()).first->second;
    if (timeline_.now() - since <= kRivalsGoneWithin) continue;
    find(fmt::format("one-server: {} and {} fly one vehicle", run.server->name(),
                     other.server->name()));
    rivals_[key] = timeline_.now() + 1h;
  }
}

bool Properties::has_been_refused(const Run& run) {
  return static_cast<const ServerProgram*>(run.server)->has_been_refused();
}

void Properties::on_run_end(std::uint64_t run_id, bool is_finished, std::string certificate,
                            const std::string& reason, const Network& network) {
  Run& run = runs_[run_id];
  const auto full = network.last_full();
  if (run.is_realtime && !is_finished && full && timeline_.now() - *full < kLastAttempts)
    is_overloaded_ = true;
  run.has_ended = true;
  run.ended = timeline_.now();
  run.is_finished = is_finished;
  if (run.began) run.summary.duration_s = sync::to_seconds(timeline_.now() - *run.began);
  run.certificate = std::move(certificate);
  run.failure = reason;
  if (!has_been_refused(run)) run.flight->requests().on_end();
  run.is_failure_judged = reason.empty() || run.flight->on_failed(reason, timeline_.now());
}

void Properties::on_exit(const Program& program) {
  if (program.role() == Role::kClient && !program.reason().empty()) check_client_end(program);
}

/// What a client says of its server is true.
void Properties::check_client_end(const Program& client) {
  const std::string& reason = client.reason();
  const auto finds = [&](const std::string& but) {
    find(fmt::format("reason: {} ends with '{}', but {}", client.name(), reason, but));
  };
  const auto run = runs_.find(joined_[client.name()]);
  static const std::string kFailed = "the run failed: ";
  if (reason.rfind(kFailed, 0) == 0) {
    const std::string said = reason.substr(kFailed.size(), kMostText - 6);  // the rest may be cut
    if (run == runs_.end() || !run->second.has_ended || run->second.is_finished)
      finds("it did not");
    else if (run->second.failure.rfind(said, 0) != 0)
      finds("that is not why: " + run->second.failure);
  } else if (reason.find("expected it to finish") != std::string::npos && run != runs_.end()) {
    const auto heard = client.find_heard(run->first, run->second.server->id());
    const double deadline_s = run->second.flight->sync().wait.server_deadline_s;
    if (heard && client.awake() - *heard < sync::to_duration(deadline_s) - FlightWatch::kSlack)
      finds(fmt::format("heard it {:.3f} s before", sync::to_seconds(client.awake() - *heard)));
  }
}

void Properties::on_announced(const Program& program, const Participant& message,
                              const sync::Servers& heard) {
  check_announcement(program, message);
  has_libraries_ = has_libraries_ || message.library_sha256().size() > 0;
  const bool is_honest =
      program.role() == Role::kRecorder ||
      (program.role() == Role::kClient && static_cast<const ClientProgram&>(program).is_honest());
  const auto known =
      announced_.try_emplace(message.name().to_string(), Announced{is_honest, timeline_.now()})
          .first;
  known->second.is_honest = known->second.is_honest && is_honest;
  if (message.run_id() == 0) return;
  const bool is_client = program.role() == Role::kClient;
  const auto flown = runs_.find(message.run_id());
  if (program.role() == Role::kForeign && message.role() == ParticipantRole::ROLE_RECORDER &&
      message.ready() && flown != runs_.end())
    flown->second.recorders.insert(program.name());  // as the server does
  if (!is_client && program.role() != Role::kRecorder) return;
  if (flown == runs_.end())
    return find(fmt::format("joins: {} joins run {:016x}, which no server flies", program.name(),
                            message.run_id()));
  Run& run = flown->second;
  if (message.done()) run.done.try_emplace(program.name(), timeline_.now());
  if (is_client && !static_cast<const ClientProgram&>(program).keeps_contract())
    run.wrong.insert(program.name());
  std::uint64_t& joined = joined_[program.name()];
  if (joined != message.run_id()) {
    if (run.has_ended) too_late_.insert(program.name());
    const std::uint64_t left = std::exchange(joined, message.run_id());
    if (is_client) check_join(program, message.run_id(), left, heard);
  }
  if (is_client && !run.has_status)
    find(fmt::format("joins: {} joins run {:016x}, whose claim is not settled", program.name(),
                     message.run_id()));
  if (!message.ready()) return;
  const bool is_first = is_client ? run.ready.insert(program.name()).second
                                  : run.recorders.insert(program.name()).second;
  if (!is_first) return;
  run.ready_since[program.name()] = timeline_.now();
  for (const std::uint32_t vehicle : message.vehicle_ids())
    run.ready_of[vehicle].insert(program.name());
  // It may know the server first. Then the server learns of it at its next look.
  const Peer& server = run.server->peer();
  if (is_client && (server.matched_readers(TopicId::kState).count(program.id()) == 0 ||
                    server.matched_writers(TopicId::kCommand).count(program.id()) == 0))
    run.is_match_late = true;
  if (!program.sees(run.server->id()))
    find(fmt::format("ready: {} says so of run {:016x} before it sees the server", program.name(),
                     message.run_id()));
}

/// What a program says of itself is true.
void Properties::check_announcement(const Program& program, const Participant& message) {
  const bool is_client = program.role() == Role::kClient;
  if (!is_client && program.role() != Role::kRecorder) return;
  const auto role = is_client ? ParticipantRole::ROLE_CONTROLLER : ParticipantRole::ROLE_RECORDER;
  const auto run = runs_.find(message.run_id());
  bool has_scenario =
      run == runs_.end() || message.scenario_sha256().to_string() == run->second.scenario_sha256;
  bool has_vehicles = message.vehicle_ids().empty();
  if (is_client) {
    const ClientProgram::Options& options = static_cast<const ClientProgram&>(program).options();
    has_scenario = has_scenario || options.has_other_scenario;
    const std::set<std::uint32_t> own(options.vehicle_ids.begin(), options.vehicle_ids.end());
    const auto& said = message.vehicle_ids();
    has_vehicles = !said.empty() && std::all_of(said.begin(), said.end(),
                                                [&](auto id) { return own.count(id) > 0; });
  }
  const bool is_true = message.role() == role && has_scenario && has_vehicles &&
                       message.contract_sha256().to_string() == bus::kContractSha256 &&
                       message.host().to_string() == program.process().host().name() &&
                       (!is_client || message.last_complete_step() == -1) &&
                       (message.run_id() != 0 || (!message.ready() && !message.done()));
  if (!is_true)
    find(fmt::format("announces: {} says something of itself that is not so", program.name()));
}

void Properties::on_unclaimed(const Program& program, const Peer& writer, const Network& network) {
  const Process& process = writer.process();
  const auto since = network.find_connected_since(program.id(), writer.id());
  const bool may_know = since && timeline_.now() - *since > kHeardWithin;
  if (process.is_server() && !process.has_ended() && !process.is_stopped() && may_know)
    find(fmt::format("claims: {} misses the claim of {}", program.name(), process.name()));
}

/// A client joins a run that goes on, and leaves one only after its end or for a later server's.
void Properties::check_join(const Program& program, std::uint64_t run_id, std::uint64_t left,
                            const sync::Servers& heard) {
  const SimStatus* status = heard.find_status(run_id);
  if (!status || sync::calc_progress(status->phase()) < 0)
    find(fmt::format("joins: {} joins run {:016x}, and has heard {}", program.name(), run_id,
                     status ? "its end" : "no status of it"));
  const sync::Time now = program.process().host().now();
  const auto run = runs_.find(left);
  if (run == runs_.end() || run->second.server == runs_.at(run_id).server) return;
  for (const sync::Run& other : heard.runs(now))
    if (other.parameters.run_id() == run_id &&
        other.server_known_since <= heard.find_last_heard(left))
      find(fmt::format("follows: {} goes over to {}, which was there before", program.name(),
                       runs_.at(run_id).server->name()));
  if (!heard.is_silent(left, now))
    find(fmt::format("follows: {} leaves {}, which it hears", program.name(),
                     run->second.server->name()));
}

/// A recorder is as far as its last vehicle.
void Properties::on_progress(const Program& recorder, std::int64_t step,
                             const std::map<std::uint32_t, std::int64_t>& newest) {
  for (const auto& [vehicle, last] : newest)
    if (last < step)
      find(fmt::format("progress: {} says step {}, and has none after {} of vehicle {}",
                       recorder.name(), step, last, vehicle));
}

/// A server leaves requests for the runs of others to them.
void Properties::on_replied(const Program& server, std::uint64_t request_id,
                            const Network& network) {
  const auto request = requests_.find(request_id);
  const auto run = request == requests_.end() ? runs_.end() : runs_.find(request->second);
  if (run == runs_.end() || run->second.server == &server || run->second.has_ended ||
      !run->second.has_status || timeline_.now() - run->second.phase_since < kHeardWithin ||
      run->second.server->process().has_ended() || run->second.server->process().is_stopped())
    return;
  const auto since = network.find_connected_since(server.id(), run->second.server->id());
  if (!since || timeline_.now() - *since < kHeardWithin) return;
  find(fmt::format("operator: {} answers a request to {}", server.name(),
                   run->second.server->name()));
}

void Properties::on_stopped(const Program& program) { stopped_[program.name()] = timeline_.now(); }

/// A program says that run `run_id` is silent for `said_s`.
void Properties::check_silence(const Program& program, std::uint64_t run_id, double said_s) {
  const auto run = runs_.find(run_id);
  if (run == runs_.end()) return;
  const auto heard = program.find_heard(run_id, run->second.server->id());
  if (!heard) return;
  const double silent_s = sync::to_seconds(program.awake() - *heard);
  if (said_s > silent_s + 0.1)
    find(
        fmt::format("named: {} says that run {:016x} is silent for {:.1f} s, and heard it {:.3f} s "
                    "before",
                    program.name(), run_id, said_s, silent_s));
}

/// A program that was stopped itself does not say that its server is silent, and no program says
/// that it was silent for longer than it was.
void Properties::on_line(const Program& program, const std::string& text,
                         const sync::Servers& heard) {
  for (auto& [run_id, run] : runs_)
    if (run.server == &program) run.flight->on_line(text, timeline_.now());
  static const std::string kServer = "server of run ", kSilent = "(silent for ";
  const std::size_t silent = text.find(kSilent);
  if (silent == std::string::npos) return;
  const std::size_t named = text.find(kServer);
  if (named != std::string::npos)
    check_silence(program, std::stoull(text.substr(named + kServer.size(), 16), nullptr, 16),
                  std::stod(text.substr(silent + kSilent.size())));
  const auto continued = continued_.find(program.name());
  if (continued == continued_.end() || timeline_.now() - continued->second > kQuietTime / 2) return;
  // A shorter stop counts as silence of the server, which does no harm.
  if (continued->second - stopped_.at(program.name()) < kQuietTime) return;
  const Host& host = program.process().host();
  for (const auto& [run_id, run] : runs_) {
    if (text.find(fmt::format("{:016x}", run_id)) == std::string::npos) continue;
    const auto last = heard.find_last_heard(run_id);
    const Instant silence = timeline_.now() - stopped_.at(program.name()) + kQuietTime / 2;
    if (last && host.now() - *last < silence)
      find(fmt::format("named: {} was stopped, and says: {}", program.name(), text));
  }
}

void Properties::on_interrupted(const Program& program) {
  for (const auto& [run_id, run] : runs_)
    if (run.server == &program) run.flight->on_interrupted();
}

void Properties::on_killed(const Program& program) { killed_[program.name()] = timeline_.now(); }

void Properties::on_continued(const Program& program) {
  continued_[program.name()] = timeline_.now();
}

void Properties::on_disturbed(const Program& program) {
  for (auto& [run_id, run] : runs_)
    if (run.server == &program) {
      run.disturbed = timeline_.now();
      run.flight->on_disturbed();
    }
}

// --- at its end ----------------------------------------------------------------------------------

void Properties::check(const Plan& plan, const std::vector<std::unique_ptr<Program>>& programs,
                       const FlownScenario& flown) {
  for (const auto& [run_id, run] : runs_) {
    const bool is_of_flight = run.failure == flown.failure || run.has_mistakes || !run.is_exact;
    if (!run.is_failure_judged && run.has_ended && !is_of_flight)
      find(fmt::format("reason: run {:016x} fails without a cause: {}", run_id, run.failure));
    const bool says_exact =
        run.timing == "exact" || run.timing.find("real-time, 0 of ") != std::string::npos;
    if (run.has_ended && !has_been_refused(run) && !run.timing.empty() &&
        says_exact != run.is_exact)
      find(fmt::format("timing-label: run {:016x} is {}exact, its label says '{}'", run_id,
                       run.is_exact ? "" : "not ", run.timing));
    if (plan.promise == Promise::kCalm && run.began && !run.is_match_late)
      check_begin(run_id, run, flown);
    const bool is_lockstep = flown.scenario.sync.mode == config::SyncMode::kLockstep;
    if ((plan.promise == Promise::kCalm || (plan.promise == Promise::kSuspend && is_lockstep)) &&
        run.is_finished && !run.is_exact)
      find(fmt::format("calm: run {:016x} has late steps", run_id));
  }
  // In real time nobody waits for a link that carries less than is sent.
  const Promise promise = is_overloaded_ ? Promise::kNone : plan.promise;
  std::map<std::filesystem::path, const Program*> folders;
  for (const auto& program : programs) {
    if (!program->process().has_ended()) find(fmt::format("ends: {} still runs", program->name()));
    check_exit(*program);
    if (program->role() == Role::kServer && !flown.failure.empty()) check_failure(*program, flown);
    if (program->role() == Role::kRecorder) {
      const auto& recorder = static_cast<const RecorderProgram&>(*program);
      if (!recorder.folder().empty()) folders[recorder.folder()] = program.get();
      for (const StoredRecording& recording : recorder.recordings())
        check_recording(*program, recording, flown, promise);
    }
    if (promise != Promise::kNone && program->role() == Role::kServer)
      check_end(*program, programs);
    const bool may_yield = promise == Promise::kTwoServers && program->role() == Role::kServer;
    if (promise != Promise::kNone && has_joined(*program) && !may_yield &&
        too_late_.count(program->name()) == 0 && program->exit_code().value_or(0) != 0)
      find(fmt::format("finishes: {} ends with {}: {}", program->name(), *program->exit_code(),
                       program->reason()));
  }
  const bool is_power_cut =
      std::any_of(plan.faults.begin(), plan.faults.end(),
                  [](const Fault& fault) { return fault.kind == Fault::Kind::kPowerCut; });
  for (const auto& [folder, program] : folders)
    for (StoredRecording& recording : read_recordings(folder)) {
      if (is_power_cut && !recording.is_closed) recording.damages.clear();
      check_recording(*program, recording, flown, promise);
    }
  if (promise != Promise::kNone && !is_any_finished()) find("finishes: no flight was finished");
}

/// When `count` of the programs were ready.
Instant Properties::find_ready(const Run& run, const std::set<std::string>& names,
                               int count) const {
  std::vector<Instant> since;
  for (const std::string& name : names) since.push_back(run.ready_since.at(name));
  std::sort(since.begin(), since.end());
  return count > 0 ? since.at(static_cast<std::size_t>(count) - 1) : Instant(0);
}

/// A flight begins as soon as the expected ones are ready.
void Properties::check_begin(std::uint64_t run_id, const Run& run, const FlownScenario& flown) {
  const config::WaitFor& expected = flown.scenario.sync.wait_for;
  Instant ready = find_ready(run, run.recorders, expected.recorders);
  for (const auto& [vehicle, clients] : run.ready_of)
    ready = std::max(ready, find_ready(run, clients, expected.controllers));
  if (*run.began > ready + kBeginsWithin)
    find(fmt::format("calm: run {:016x} begins {:.3f} s after the last one is ready", run_id,
                     sync::to_seconds(*run.began - ready)));
}

/// A server ends soon after the recorders of its finished run, and not before them.
void Properties::check_end(const Program& server,
                           const std::vector<std::unique_ptr<Program>>& programs) {
  if (server.was_killed() || server.was_interrupted() || !server.exit_code()) return;
  for (const auto& [run_id, run] : runs_) {
    if (run.server != &server || !run.is_finished) continue;
    Instant last = run.ended;
    const auto continued = continued_.find(server.name());
    if (continued != continued_.end()) last = std::max(last, continued->second);
    for (const auto& program : programs) {
      const bool took_part =
          run.recorders.count(program->name()) > 0 || run.done.count(program->name()) > 0;
      if (program->role() != Role::kRecorder) continue;
      if (program->was_killed()) {  // it may have been known before it was ready
        last = std::max(last, killed_.at(program->name()) + sync::kPresumedDeadAfter);
        continue;
      }
      if (!took_part) continue;
      last = std::max(last, program->ended());
      const auto ready = run.ready_since.find(program->name());
      const bool is_known =
          ready != run.ready_since.end() && ready->second + kHeardWithin / 2 < run.ended;
      const auto done = run.done.find(program->name());
      if (is_known && server.ended() < run.ended + kWaitsFor &&
          (done == run.done.end() || done->second > server.ended()))
        find(fmt::format("waits: {} ends before {} has its recording", server.name(),
                         program->name()));
    }
    if (server.ended() > last + kEndsWithin)
      find(fmt::format("prompt: {} ends {:.3f} s after its last recorder", server.name(),
                       sync::to_seconds(server.ended() - last)));
  }
}

/// A flight whose plant or mission fails in one process fails here, too, at the same step, if no
/// client made mistakes.
void Properties::check_failure(const Program& server, const FlownScenario& flown) {
  const std::uint64_t run_id = static_cast<const ServerProgram&>(server).run_id();
  const Run& run = runs_[run_id];
  if (run.has_mistakes) return;
  if (run.is_finished)
    find(fmt::format("fails: run {:016x} is finished, expected: {}", run_id, flown.failure));
  for (const auto& [vehicle, rows] : run.rows) {
    if (rows.size() > flown.last_step + 1)
      find(fmt::format("fails: run {:016x} has step {}, expected: {}", run_id, rows.size() - 1,
                       flown.failure));
    const bool is_answered = run.last.at(vehicle).kind == model::AnswerKind::kAccepted;
    if (flown.is_refused || rows.size() != flown.last_step + 1 || !is_answered) continue;
    if (run.is_exact && server.exit_code() && !server.was_interrupted() &&
        server.reason() != flown.failure)
      find(fmt::format("fails: {} ends with '{}', expected: {}", server.name(), server.reason(),
                       flown.failure));
  }
}

void Properties::check_exit(const Program& program) {
  if (program.was_killed() || !program.exit_code()) return;
  const int code = *program.exit_code();
  if ((code != 0) != !program.reason().empty())
    find(fmt::format("exit-code: {} ends with {} and the reason '{}'", program.name(), code,
                     program.reason()));
  if (code != 0) return;
  if (program.role() == Role::kServer) {
    const auto& server = static_cast<const ServerProgram&>(program);
    if (!runs_[server.run_id()].is_finished)
      find(fmt::format("exit-code: {} ends with 0, but its run was not finished", program.name()));
  }
  if (program.role() == Role::kRecorder) {
    const auto& recorder = static_cast<const RecorderProgram&>(program);
    if (recorder.has_recorded() ? !recorder.is_complete() : !program.was_interrupted())
      find(fmt::format("exit-code: {} ends with 0, but its recording is not complete",
                       program.name()));
  }
}

}  // namespace sls::worlds
