#include "sim_server/core/answers/command_gate.hpp"

#include <algorithm>
#include <utility>

#include "common/sync/invariant.hpp"

namespace sls::sim {
namespace {

constexpr std::size_t kRememberedAnswers =
    64;  // copies older than that are rejected as wrong steps

Verdict to_verdict(Defect defect) {
  switch (defect) {
    case Defect::kNotFinite:
      return Verdict::kNotFinite;
    case Defect::kForceLimit:
      return Verdict::kForceLimit;
    case Defect::kUndefined:
      return Verdict::kUndefined;
    case Defect::kErrorCode:
      return Verdict::kErrorCode;
    case Defect::kUnknownStage:
      return Verdict::kUnknownStage;
    case Defect::kEarlyEnd:
      return Verdict::kEarlyEnd;
  }
  return Verdict::kErrorCode;
}

/// Order by strength, strongest first; then by name and peer, not by time of sample.
bool is_stronger(const ReadyClient& a, const ReadyClient& b) {
  if (a.strength != b.strength) return a.strength > b.strength;
  if (a.name != b.name) return a.name < b.name;
  return a.peer < b.peer;
}

}  // namespace

const char* to_string(Verdict verdict) {
  switch (verdict) {
    case Verdict::kAccepted:
    case Verdict::kHeld:
    case Verdict::kDuplicate:
    case Verdict::kSuperseded:
    case Verdict::kLate:
      return "";
    case Verdict::kNotFinite:
      return to_string(Defect::kNotFinite);
    case Verdict::kForceLimit:
      return to_string(Defect::kForceLimit);
    case Verdict::kOtherRun:
      return "another run_id";
    case Verdict::kEarly:
      return "a step whose state was not published yet";
    case Verdict::kWrongStep:
      return "a step that is not awaited";
    case Verdict::kContradiction:
      return "another answer to the same step";
    case Verdict::kUnknownVehicle:
      return "a vehicle_id of no vehicle here";
    case Verdict::kUnknownClient:
      return "a sender that is not announced as a ready controller";
    case Verdict::kUndefined:
      return to_string(Defect::kUndefined);
    case Verdict::kErrorCode:
      return to_string(Defect::kErrorCode);
    case Verdict::kUnknownStage:
      return to_string(Defect::kUnknownStage);
    case Verdict::kEarlyEnd:
      return to_string(Defect::kEarlyEnd);
  }
  return "";
}

CommandGate::CommandGate(std::uint64_t run_id, std::uint32_t vehicle_id, const AnswerLimits& limits)
    : run_id_(run_id), vehicle_id_(vehicle_id), limits_(limits) {}

void CommandGate::set_clients(const std::vector<ReadyClient>& clients) {
  std::vector<Client> updated;
  for (const ReadyClient& identity : clients) {
    Client client;
    // A client that joins in flight may not get the awaited state, which the others answer.
    client.is_new = has_begun_ && !clients_.empty();
    if (Client* known = find_client(identity.peer)) client = std::exchange(*known, {});
    client.identity = identity;
    updated.push_back(std::move(client));
  }
  drop_held();  // of clients that have left
  std::sort(updated.begin(), updated.end(),
            [](const Client& a, const Client& b) { return is_stronger(a.identity, b.identity); });
  clients_ = std::move(updated);
  settle();
}

void CommandGate::expect(std::uint64_t step) {
  if (accepted_) {
    past_[step_] = Past{accepted_from_, accepted_->answer.f_Q_W};
    for (Client& client : clients_) client.refusal.clear();
  } else if (step > step_) {
    past_[step_] = std::nullopt;
  }
  while (past_.size() > kRememberedAnswers) past_.erase(past_.begin());
  step_ = step;
  has_begun_ = true;
  accepted_.reset();
  refused_.reset();
  take_over_.reset();
  drop_held();
}

void CommandGate::drop_held() {
  for (Client& client : clients_) {
    if (client.held) count(Verdict::kSuperseded);
    client.held.reset();
  }
}

Verdict CommandGate::offer(const OfferedAnswer& offered, const bus::PeerId& sender) {
  const Verdict verdict = judge(offered, sender);
  count(verdict);
  return verdict;
}

Verdict CommandGate::judge(const OfferedAnswer& offered, const bus::PeerId& sender) {
  Client* client = find_client(sender);
  if (client) ++client->answers;
  if (offered.run_id != run_id_) return Verdict::kOtherRun;
  if (offered.vehicle_id != vehicle_id_) return Verdict::kUnknownVehicle;
  if (offered.is_early && offered.step >= step_) return Verdict::kEarly;

  if (const auto defect = find_defect(offered.step, offered.answer, limits_)) {
    if (client) note_refusal(*client, offered, *defect);
    return to_verdict(*defect);
  }
  if (offered.step != step_) return judge_past(offered, sender);
  if (!client) return Verdict::kUnknownClient;
  // Only a client's first answer to a step counts; another one is a copy or a contradiction.
  const auto& first = accepted_ && accepted_from_ == sender ? accepted_ : client->held;
  if (first)
    return first->answer.f_Q_W == offered.answer.f_Q_W ? Verdict::kDuplicate
                                                       : Verdict::kContradiction;
  client->is_new = client->silent = false;
  client->misses = 0;
  client->identity.is_gone = false;
  client->answered_end = step_ + 1;
  if (!client->is_refused(step_)) client->refusal.clear();  // of an earlier step
  if (accepted_) return Verdict::kSuperseded;
  client->held = offered;
  settle();
  return accepted_ ? Verdict::kAccepted : Verdict::kHeld;  // an earlier one was not awaited
}

void CommandGate::note_refusal(Client& client, const OfferedAnswer& offered, Defect defect) {
  const std::uint64_t step = offered.step;
  const auto past = past_.find(step);
  const bool is_open =
      step == step_ ? !accepted_ && !client.held : past != past_.end() && !past->second;
  const bool is_newer = client.refusal.empty() || step > client.refused_step;
  if (!is_open || !is_newer) return;
  if (step == step_) refused_ = offered;
  client.refused_step = step;
  client.refusal = describe_refusal(defect, step, offered.answer, limits_, client.identity.name);
  settle();
}

Verdict CommandGate::judge_past(const OfferedAnswer& offered, const bus::PeerId& sender) {
  const auto past = past_.find(offered.step);
  if (past == past_.end())
    return is_of_distant_standby(offered, sender) ? Verdict::kSuperseded : Verdict::kWrongStep;
  const Eigen::Vector3d& force = offered.answer.f_Q_W;
  std::optional<Past>& first = past->second;
  if (first && first->sender == sender)
    return first->force == force ? Verdict::kDuplicate : Verdict::kContradiction;
  Client* client = find_client(sender);
  if (!client) return Verdict::kWrongStep;
  client->is_new = false;
  if (first) return Verdict::kSuperseded;
  client->refusal.clear();
  first = Past{sender, force};
  return Verdict::kLate;
}

/// True for an answer older than the remembered ones while another client flies: its sender is far
/// away, which is no mistake of a standby.
bool CommandGate::is_of_distant_standby(const OfferedAnswer& offered, const bus::PeerId& sender) {
  if (past_.empty() || offered.step >= past_.begin()->first || !find_client(sender)) return false;
  const std::optional<Past>& last = past_.rbegin()->second;
  return last && last->sender != sender;
}

void CommandGate::settle() {
  if (accepted_) return;
  const Client* awaited = find_awaited();
  if (!awaited || !awaited->held) return;
  accepted_from_ = awaited->identity.peer;
  accepted_ = std::exchange(find_client(accepted_from_)->held, std::nullopt);
  sync::keep(accepted_->step == step_, "a force answers the state of its own step");
  if (flyer_ && flyer_->peer != accepted_from_) {
    take_over_ = TakeOver{flyer_->name, awaited->identity.name};
    ++counters_.take_overs();
  }
  flyer_ = awaited->identity;
  drop_held();
}

int CommandGate::count_miss() {
  const Client* awaited = find_awaited();
  return awaited ? ++find_client(awaited->identity.peer)->misses : 0;
}

const CommandGate::Client* CommandGate::find_awaited() const {
  const Client* silent = nullptr;
  const Client* gone = nullptr;
  for (const Client& client : clients_) {
    if (client.is_refused(step_)) continue;
    const Client*& first = client.identity.is_gone ? gone : silent;
    if (client.is_expected()) return &client;
    if (!first) first = &client;
  }
  return silent ? silent : gone;  // all are silent: await the strongest
}

std::optional<ReadyClient> CommandGate::awaited_client() const {
  const Client* awaited = find_awaited();
  return awaited ? std::optional(awaited->identity) : std::nullopt;
}

bool CommandGate::pass_over_silent_client() {
  const Client* awaited = find_awaited();
  if (!awaited || accepted_) return false;
  const bool has_next = std::any_of(clients_.begin(), clients_.end(), [&](const Client& client) {
    return &client != awaited && client.is_expected() && !client.is_refused(step_);
  });
  if (!has_next) return false;
  if (!flyer_) flyer_ = awaited->identity;  // the first awaited client, for the take-over message
  find_client(awaited->identity.peer)->silent = true;
  settle();
  return true;
}

std::optional<std::string> CommandGate::refusal() const {
  const Client* awaited = find_awaited();
  const bool can_answer = awaited && !awaited->identity.is_gone;
  const bool is_any_refused =
      std::any_of(clients_.begin(), clients_.end(),
                  [this](const Client& client) { return client.is_refused(step_); });
  if (can_answer || !is_any_refused || accepted_) return std::nullopt;
  return describe_refusals();
}

std::string CommandGate::describe_refusals() const {
  std::string refusals;
  if (accepted_) return refusals;
  for (const Client& client : clients_)
    if (!client.refusal.empty()) refusals += (refusals.empty() ? "" : "; ") + client.refusal;
  return refusals;
}

CommandGate::Client* CommandGate::find_client(const bus::PeerId& peer) {
  for (Client& client : clients_)
    if (client.identity.peer == peer) return &client;
  return nullptr;
}

void CommandGate::count(Verdict verdict) {
  switch (verdict) {
    case Verdict::kAccepted:
    case Verdict::kHeld:
    case Verdict::kLate:  // the held or fail-safe step is counted instead
      return;
    case Verdict::kDuplicate:
      ++counters_.duplicate();
      return;
    case Verdict::kSuperseded:
      ++counters_.superseded();
      return;
    case Verdict::kNotFinite:
      ++counters_.rejected_not_finite();
      return;
    case Verdict::kForceLimit:
      ++counters_.rejected_force_limit();
      return;
    case Verdict::kOtherRun:
      ++counters_.rejected_run();
      return;
    case Verdict::kEarly:
    case Verdict::kWrongStep:
    case Verdict::kContradiction:
      ++counters_.rejected_step();
      return;
    case Verdict::kUnknownVehicle:
      ++counters_.rejected_vehicle();
      return;
    case Verdict::kUnknownClient:
      ++counters_.rejected_client();
      return;
    case Verdict::kUndefined:
    case Verdict::kErrorCode:
    case Verdict::kUnknownStage:
    case Verdict::kEarlyEnd:
      ++counters_.rejected_fault();
      return;
  }
}

}  // namespace sls::sim
