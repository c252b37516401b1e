#include "worlds/flight_watch.hpp"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>

#include "common/bus/topics.hpp"
#include "common/sync/membership.hpp"
#include "sim_server/core/pacing/retransmission_timer.hpp"
#include "worlds/program.hpp"

namespace sls::worlds {
namespace {

using namespace std::chrono_literals;

/// A server looks at its participants ten times a second.
constexpr Instant kLookInterval = 100ms;
constexpr Instant kKnownAfter = 5 * kLookInterval;
/// It looks for a stop signal every 20 ms, between two requests.
constexpr Instant kObeysWithin = 1s;
constexpr Instant kGivesUpWithin = 2s;
/// A server may presume a client dead that was silent for this long, until its next look.
constexpr Instant kForgottenAfter = sync::kPresumedDeadAfter - FlightWatch::kSlack;

/// False if a number that the server looks at is not finite.
bool is_finite(const ControlCommand& command) {
  double sum = 0;
  for (const double force : command.f_Q_W_n()) sum += force;
  for (const double number : command.controller().numbers()) sum += number;
  for (const double position : command.reference().position_m()) sum += position;
  return std::isfinite(sum);
}

}  // namespace

FlightWatch::FlightWatch(const config::Scenario& scenario, std::uint64_t run_id,
                         std::vector<std::uint32_t> vehicle_ids, const Program& server,
                         std::function<void(std::string)> find)
    : server_(server),
      sync_(scenario.sync),
      limits_(sim::make_answer_limits(scenario)),
      scenario_sha256_(scenario.sha256),
      run_id_(run_id),
      vehicle_ids_(std::move(vehicle_ids)),
      began_(server.awake()),
      find_(std::move(find)),
      status_(sync_, vehicle_ids_.size(), server, find_),
      requests_(run_id_, vehicle_ids_, find_) {}

void FlightWatch::Heard::hear(Instant now, Instant awake) {
  if (now - heard >= kForgottenAfter) back = now;
  heard = now;
  heard_awake = awake;
}

// --- arrives at the server -----------------------------------------------------------------------

/// True unless the answer has a mistake for which it is refused.
bool FlightWatch::is_sound(const ControlCommand& command, std::uint64_t step) const {
  const auto& force = command.f_Q_W_n();
  const std::uint32_t stage = command.controller().stage_index();
  const bool is_over =
      command.mission() == MissionPhase::MISSION_FINISHED || stage == limits_.stages;
  return is_finite(command) && std::hypot(force[0], force[1], force[2]) <= limits_.force &&
         command.fault() == FaultCode::FAULT_NONE &&
         command.mission() < MissionPhase::MISSION_FAILED && stage <= limits_.stages &&
         !(is_over && step < limits_.earliest_end);
}

void FlightWatch::on_member(const Participant& message, const bus::PeerId& peer,
                            const Process& sender, Instant now) {
  if (message.role() == ParticipantRole::ROLE_RECORDER) {
    Recorder& recorder = recorders_[sender.name()];
    const bool is_ready = message.ready() && message.run_id() == run_id_;
    if (!is_ready || recorder.ready == Instant(0)) recorder.ready = is_ready ? now : Instant(0);
    recorder.process = &sender;
    recorder.peer = peer;
    recorder.hear(now, server_.awake());
  }
  if (message.role() != ParticipantRole::ROLE_CONTROLLER) return;
  Client& client = clients_[sender.name()];
  const bool is_ready = message.ready() && message.run_id() == run_id_ &&
                        message.scenario_sha256().to_string() == scenario_sha256_ &&
                        message.contract_sha256().to_string() == bus::kContractSha256;
  if (is_ready && !client.is_ready) client.ready = now;
  if (!is_ready && client.is_ready) client.left = now;
  client.is_ready = is_ready;
  client.process = &sender;
  client.order = {-message.strength(), message.name().to_string(), peer};
  peers_.insert(peer);
  has_libraries_ = has_libraries_ || message.library_sha256().size() > 0;
  client.vehicle_ids.assign(message.vehicle_ids().begin(), message.vehicle_ids().end());
  client.hear(now, server_.awake());
  if (is_ready) rightful_.insert(sender.name());
}

void FlightWatch::on_answers(const Commands& sample, const Process& sender, Instant now) {
  Client& client = clients_[sender.name()];
  client.process = &sender;
  client.hear(now, server_.awake());
  for (const ControlCommand& command : sample.vehicles())
    client.has_erred = client.has_erred || !is_sound(command, sample.step());
  if (sample.run_id() != run_id_ || !has_begun_ || sample.step() != step_) return;
  if (client.answered_step != step_) {
    client.answers.clear();
    client.refused.clear();
  }
  client.answered_step = step_;
  for (const ControlCommand& command : sample.vehicles())
    (is_sound(command, sample.step()) ? client.answers : client.refused)
        .try_emplace(command.vehicle_id(), now);
}

void FlightWatch::on_request(ControlAction action) {
  is_disturbed_ = true;
  for (auto& [vehicle, lacking] : lacking_)
    lacking.since = server_.awake();  // a pause is no absence
  if (action == ControlAction::ACTION_STOP && !stop_requested_) stop_requested_ = server_.awake();
  if (action != ControlAction::ACTION_PAUSE)
    paused_.reset();
  else if (!paused_)
    paused_ = server_.awake();
}

// --- the server does -----------------------------------------------------------------------------

void FlightWatch::on_published(std::uint64_t step, Instant now) {
  const auto disobeys = [&](const std::optional<Instant>& since, const char* what) {
    const Instant waited = server_.awake() - std::max(since.value_or(disturbed_), disturbed_);
    if (since && !is_disturbed() && waited > kObeysWithin)
      find_(fmt::format("obeys: step {} leaves {:.3f} s after {}", step, sync::to_seconds(waited),
                        what));
  };
  disobeys(interrupted_, "SIGINT");
  disobeys(stop_requested_, "an operator's stop");
  disobeys(paused_, "an operator's pause");
  check_due(step, now);
  status_.on_published(step);
  requests_.on_published(step);
  // The wait for recorders between two steps is no absence of a controller.
  if (has_begun_ && is_lockstep())
    for (auto& [vehicle, lacking] : lacking_) lacking.since += server_.awake() - recorded_awake_;
  has_begun_ = true;
  step_ = step;
  published_ = now;
  published_awake_ = server_.awake();
  sent_ = now;
  is_disturbed_ = false;
}

/// The looks of a slow server count as stops.
void FlightWatch::on_disturbed() {
  is_disturbed_ = true;
  disturbed_ = server_.awake();
  for (auto& [vehicle, lacking] : lacking_) lacking.since = disturbed_;
  status_.on_disturbed();
}

void FlightWatch::on_interrupted() { interrupted_ = server_.awake(); }

/// The library of the first client decides who may fly, and what a server remembers and discovers.
bool FlightWatch::is_unclear() const {
  return has_libraries_ || server_.peer().has_short_memory() ||
         peers_.size() >= sync::Membership::kMostMembers;
}

bool FlightWatch::is_disturbed() const { return is_disturbed_ || server_.is_slow(); }

/// In real time no state leaves before it is due, whatever happens.
void FlightWatch::check_due(std::uint64_t step, Instant now) {
  if (is_lockstep()) return;
  if (!schedule_) schedule_ = {step, now};
  const double steps = static_cast<double>(step - schedule_->first);
  const double due_s = steps * static_cast<double>(sync_.period_ns) * 1e-9 / sync_.real_time_factor;
  const double late_s = sync::to_seconds(now - schedule_->second) - due_s;
  if (late_s < -0.001 - due_s * 2e-4)
    find_(fmt::format("due: step {} leaves {:.4f} s before it is due", step, -late_s));
}

void FlightWatch::check_gap(Instant now) {
  constexpr Instant kLongest = sim::RetransmissionTimer::kLongest + kSlack;
  if (is_lockstep() && sent_ && !is_disturbed() && now - *sent_ > kLongest)
    find_(fmt::format("sent-again: the state of step {} only after {:.3f} s", step_,
                      sync::to_seconds(now - *sent_)));
}

void FlightWatch::on_resent(Instant now) {
  status_.on_resent();
  check_gap(now);
  sent_ = now;
}

void FlightWatch::on_recorded(const std::vector<model::StepRecord>& records, Instant now) {
  check_gap(now);
  sent_.reset();
  recorded_awake_ = server_.awake();
  status_.on_recorded(records);
  requests_.on_recorded(records.front().step);
  check_take_over(records, now);
  for (const model::StepRecord& record : records) {
    check_policy(record);
    if (record.kind == model::AnswerKind::kAccepted)
      flyers_[record.vehicle_id] = record.client_name;
    else
      flyers_.erase(record.vehicle_id);
  }
}

void FlightWatch::on_running(Instant now) {
  check_gap(now);
  const Instant patience = sync::to_duration(sync_.calc_controller_patience_s()) + kGivesUpWithin;
  const Instant awake = server_.awake();
  if (is_disturbed() || !sent_) return;  // no step is flown while a recorder is waited for
  for (const auto& [vehicle, lacking] : lacking_)
    if (awake - lacking.since > patience)
      return find_(fmt::format("gives-up: vehicle {} is flown without answers for {:.3f} s",
                               vehicle, sync::to_seconds(awake - lacking.since)));
  const Instant waited = awake - std::max(published_awake_, disturbed_);
  if (waited > patience)
    find_(fmt::format("gives-up: step {} waits for {:.3f} s", step_, sync::to_seconds(waited)));
}

/// A step ends when each vehicle has the answer that it awaits: another client's, if the stronger
/// ones have been silent for `take_over_s` or are known to be dead.
void FlightWatch::check_take_over(const std::vector<model::StepRecord>& records, Instant now) {
  Instant due{0};
  std::string taken_over_by;
  for (const model::StepRecord& record : records) {
    const auto own = check_flyer(record, now);
    if (!own) return;
    due = std::max(due, *own);
    const auto before = flyers_.find(record.vehicle_id);
    const bool is_known = clients_.at(record.client_name).ready + kKnownAfter < published_;
    if (before == flyers_.end() || !is_known) return;
    if (before->second != record.client_name) taken_over_by = record.client_name;
  }
  if (is_lockstep() && !is_disturbed() && !taken_over_by.empty() && now > due + kSlack)
    find_(fmt::format("take-over: '{}' flies step {} only {:.3f} s after it was due", taken_over_by,
                      step_, sync::to_seconds(now - due)));
}

/// The strongest client that answers flies, and none takes over too early. Returns when the answer
/// was due; nothing if that cannot be said.
std::optional<Instant> FlightWatch::check_flyer(const model::StepRecord& record, Instant now) {
  if (record.kind != model::AnswerKind::kAccepted) return std::nullopt;
  if (rightful_.count(record.client_name) == 0)
    find_(fmt::format("answer: step {} has an answer of '{}', which is no client of this run",
                      record.step, record.client_name));
  const auto flyer = clients_.find(record.client_name);
  if (flyer == clients_.end() || !flyer->second.is_ready || is_unclear()) return std::nullopt;
  const std::uint32_t vehicle = record.vehicle_id;
  const auto answer = flyer->second.answers.find(vehicle);
  if (!flyer->second.has_answered(vehicle, record.step)) {
    find_(fmt::format("answer: step {} has an answer of '{}' that came before its state",
                      record.step, record.client_name));
    return std::nullopt;
  }
  const Instant take_over = sync::to_duration(sync_.take_over_s);
  const Instant waited = now - published_;
  const auto before = flyers_.find(vehicle);
  // The stronger ones are awaited one after the other, each until it is refused or leaves, but not
  // longer than this.
  Instant given_up = published_;
  for (const auto& [name, client] : list_stronger(flyer->second, vehicle)) {
    if (!client.is_ready || client.is_refused(vehicle, record.step)) {
      const Instant end = client.is_ready ? client.refused.at(vehicle) : client.left;
      given_up = std::max(given_up, std::min(end, given_up + take_over));
      continue;
    }
    const Instant known_dead =
        std::max(client.heard, published_) + sync::kPresumedDeadAfter + kKnownAfter;
    given_up +=
        client.process->was_killed() ? std::min(take_over, known_dead - published_) : take_over;
    const bool is_known = client.ready + kKnownAfter < published_;
    if (is_known && !client.process->has_ended() && client.has_answered(vehicle, record.step) &&
        client.answers.at(vehicle) < answer->second)
      find_(fmt::format("strongest: step {} has the answer of '{}', but '{}' had answered",
                        record.step, record.client_name, name));
    const bool flew = before != flyers_.end() && before->second == name;
    const bool has_left = client.process->has_ended() && !client.process->was_killed();
    if (is_lockstep() && flew && !has_left && !client.has_answered(vehicle, record.step) &&
        now - client.heard < kForgottenAfter && client.back + kKnownAfter < now &&
        waited < take_over - take_over / 100)
      find_(fmt::format("take-over: '{}' flies step {} after {:.3f} s without '{}'",
                        record.client_name, record.step, sync::to_seconds(waited), name));
  }
  // The answer of a client that fell silent counts when the server sees that it is back.
  return std::max({answer->second, given_up, flyer->second.back + kLookInterval});
}

/// The clients of the vehicle before `flyer`, by name, the strongest first.
std::vector<std::pair<std::string, const FlightWatch::Client&>> FlightWatch::list_stronger(
    const Client& flyer, std::uint32_t vehicle) const {
  std::map<decltype(flyer.order), std::string> names;
  for (const auto& [name, client] : clients_) {
    const auto& ids = client.vehicle_ids;
    if (std::find(ids.begin(), ids.end(), vehicle) != ids.end() && client.order < flyer.order)
      names.emplace(client.order, name);
  }
  std::vector<std::pair<std::string, const Client&>> stronger;
  for (const auto& [order, name] : names) stronger.emplace_back(name, clients_.at(name));
  return stronger;
}

void FlightWatch::check_policy(const model::StepRecord& record) {
  const auto policy = sync_.wait.controller.policy;
  if (record.kind == model::AnswerKind::kNone) return;  // the run has ended
  const bool is_held = record.kind == model::AnswerKind::kHeld;
  if (!is_held && record.kind != model::AnswerKind::kFailSafe) {
    lacking_.erase(record.vehicle_id);
    note_newest(record.vehicle_id, record.step);
    return;
  }
  if (is_lockstep() &&
      (policy == config::ControllerPolicy::kWait || policy == config::ControllerPolicy::kStop))
    find_(fmt::format("policy: step {} is flown without an answer", record.step));
  Lacking& lacking =
      lacking_.try_emplace(record.vehicle_id, Lacking{server_.awake(), published_awake_, 0})
          .first->second;
  lacking.held += is_held;
  const double held_s =
      static_cast<double>(lacking.held) * static_cast<double>(sync_.period_ns) * 1e-9;
  if (is_held && held_s > sync_.max_hold_s + 2e-9 * static_cast<double>(sync_.period_ns))
    find_(fmt::format("policy: step {} holds an answer for {:.3f} s", record.step, held_s));
}

}  // namespace sls::worlds
