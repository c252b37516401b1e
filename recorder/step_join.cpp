#include "recorder/step_join.hpp"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <utility>

namespace sls::record {
namespace {

using namespace std::chrono_literals;

/// A step for which something is missing while so many later states are in has lost it for good;
/// what came after must not wait in memory for it. Answers can be no further ahead: the server
/// keeps within 2,000 steps of what a recorder holds, and whoever answers more than it asked is not
/// heard.
constexpr std::uint64_t kMaxPending = 8192;

/// An accepted answer that has not come while so many later states are in was kept back by a client
/// that died, and the answer to a step without one will not come. Well below the lag at which the
/// server waits for the recorder.
constexpr std::size_t kMaxPatience = 1000;

/// The same in time, where the server waits for the recorder before so many states are in.
constexpr auto kMaxStuckTime = 10s;

/// No state can be that far ahead either. It bounds the memory a wrong sample can take.
constexpr std::uint64_t kMaxAhead = 65536;

/// Answers kept before the first state: more than the histories of several clients hold.
constexpr std::size_t kMaxEarly = 32768;

/// Different answers kept for one step: more than any number of clients that fly one vehicle.
constexpr std::size_t kMaxAnswers = 32;

/// Of those of one sender, who has no reason to send a second one, so that nobody keeps the others
/// out.
constexpr std::size_t kMaxAnswersOfOne = 4;

using Force = std::array<double, 3>;

bool are_same_bits(const Force& a, const Force& b) {
  return std::memcmp(a.data(), b.data(), sizeof a) == 0;
}

/// Of one client and alike in what decides whether it is the one that was accepted.
bool are_copies(const ControlCommand& a, const ControlCommand& b) {
  return a.client_name() == b.client_name() && a.mission() == b.mission() &&
         are_same_bits(a.f_Q_W_n(), b.f_Q_W_n());
}
bool are_copies(const Reference& a, const Reference& b) {
  return a.client_name() == b.client_name();
}

/// True for what the server takes as the end of a mission.
bool ends_mission(const ControlCommand& command) {
  const auto& force = command.f_Q_W_n();
  return command.mission() == MISSION_FINISHED && command.fault() == FAULT_NONE &&
         std::all_of(force.begin(), force.end(), [](double x) { return std::isfinite(x); });
}

/// Adds `sample` unless a copy of the same sender is there, or too many others.
template <class Received, class Sample>
bool add_answer(std::vector<Received>& known, const Sample& sample, const bus::PeerId& sender) {
  std::size_t of_sender = 0;
  for (const Received& other : known) {
    if (other.sender != sender) continue;
    if (are_copies(other.sample, sample) || ++of_sender == kMaxAnswersOfOne) return false;
  }
  if (known.size() >= kMaxAnswers) return false;
  known.push_back({sample, sender});
  return true;
}

/// What belongs to `command`: of the same sender and client.
template <class References, class Command>
const Reference* find_partner(const References& references, const Command& command) {
  for (const auto& reference : references)
    if (reference.sender == command.sender &&
        reference.sample.client_name() == command.sample.client_name())
      return &reference.sample;
  return nullptr;
}

/// The first answer with its reference, of whichever client, of which `is_equal` holds.
template <class Pending, class IsEqual>
void find_stand_in(const Pending& pending, IsEqual is_equal, StepRecord& record) {
  for (const auto& command : pending.commands) {
    const Reference* reference = find_partner(pending.references, command);
    if (!reference || !is_equal(command.sample)) continue;
    record.command = command.sample;
    record.sender = command.sender;
    record.reference = *reference;
    return;
  }
}

/// The answer to the step before `next`, as far as `next` tells it.
ControlCommand make_command(const VehicleState& next, const Force& f_Q_W) {
  ControlCommand command;
  command.run_id(next.run_id());
  command.vehicle_id(next.vehicle_id());
  command.step(next.step() - 1);
  command.f_Q_W_n(f_Q_W);
  command.client_name(next.controller_name());
  command.controller(next.controller());
  return command;
}

bool is_unanswered(const VehicleState& next) {
  return next.force_origin() == FORCE_HELD || next.force_origin() == FORCE_FAIL_SAFE;
}

}  // namespace

// --- samples in ----------------------------------------------------------------------------------

StepJoin::Pending* StepJoin::find(std::uint64_t step, std::uint64_t max_ahead) {
  if (step < next_step_) {
    ++dropped_.repeated;
    return nullptr;
  }
  if (step - next_step_ >= max_ahead) {
    ++dropped_.out_of_range;
    return nullptr;
  }
  const std::size_t index = static_cast<std::size_t>(step - next_step_);
  if (index >= pending_.size()) pending_.resize(index + 1);
  return &pending_[index];
}

/// Only the first state tells where the flight is: answers that came before it had to wait.
void StepJoin::begin(std::uint64_t first_state) {
  has_begun_ = true;
  if (first_state > next_step_) {
    if (gap_sink_) gap_sink_(next_step_, first_state - 1);
    next_step_ = first_state;
  }
  for (const auto& [command, sender] : std::exchange(early_commands_, {})) add(command, sender);
  for (const auto& [reference, sender] : std::exchange(early_references_, {}))
    add(reference, sender);
}

template <class Sample>
void StepJoin::keep_early(std::vector<Received<Sample>>& early, const Sample& sample,
                          const bus::PeerId& sender) {
  if (early.size() < kMaxEarly)
    early.push_back({sample, sender});
  else
    ++dropped_.out_of_range;
}

void StepJoin::add(const VehicleState& state) {
  if (!has_begun_) begin(state.step());
  Pending* pending = find(state.step(), kMaxAhead);
  if (!pending) return;
  if (pending->state) {
    ++dropped_.repeated;
    return;
  }
  pending->state = state;
  pending->state_time = clock_;
  ++states_pending_;
  hand_on_settled_steps();
}

void StepJoin::add(const ControlCommand& command, const bus::PeerId& sender) {
  if (!has_begun_) return keep_early(early_commands_, command, sender);
  Pending* pending = find(command.step(), kMaxPending);
  if (!pending) return;
  if (!add_answer(pending->commands, command, sender)) ++dropped_.repeated;
  hand_on_settled_steps();
}

void StepJoin::add(const Reference& reference, const bus::PeerId& sender) {
  if (!has_begun_) return keep_early(early_references_, reference, sender);
  Pending* pending = find(reference.step(), kMaxPending);
  if (!pending) return;
  if (!add_answer(pending->references, reference, sender)) ++dropped_.repeated;
  hand_on_settled_steps();
}

void StepJoin::set_end(std::uint64_t last_step, bool is_finished,
                       const std::string& last_controller) {
  end_ = {last_step, is_finished, last_controller};
  hand_on_settled_steps();
}

// --- how far it is -------------------------------------------------------------------------------

bool StepJoin::has_ended() const { return end_ && next_step_ > end_->step; }

bool StepJoin::is_last(std::uint64_t step) const { return end_ && step == end_->step; }

/// A run that failed or was reset may end before the state of its last step was published: nothing
/// more will tell of the answer to the step before.
bool StepJoin::is_last_published() const {
  return is_giving_up_ && end_ && !end_->is_finished && next_step_ + 1 == end_->step &&
         !next_state();
}

const VehicleState* StepJoin::next_state() const {
  return pending_.size() > 1 && pending_[1].state ? &*pending_[1].state : nullptr;
}

bool StepJoin::is_stuck(Duration patience) const {
  for (std::size_t i = 1; i < pending_.size(); ++i)
    if (pending_[i].state) return clock_ - pending_[i].state_time >= patience;
  return false;
}

bool StepJoin::is_late() const {
  return is_giving_up_ || states_pending_ > kMaxPatience || is_stuck(kMaxStuckTime);
}

std::optional<std::string> StepJoin::describe_stuck(Duration patience) const {
  if (pending_.empty() || !is_stuck(patience)) return std::nullopt;
  const Pending& first = pending_.front();
  const VehicleState* next = next_state();
  if (next && is_unanswered(*next)) return std::nullopt;  // what may not come is not missed
  std::string missing = !first.state                  ? "the state"
                        : !next                       ? "the next state"
                        : !make_record(first).command ? "the command"
                                                      : "the reference";
  if (first.state && next) missing += fmt::format(" of '{}'", next->controller_name().c_str());
  return fmt::format("step {}: {}", next_step_, missing);
}

void StepJoin::pass_time(Duration elapsed) {
  clock_ += elapsed;
  hand_on_settled_steps();
  while (!pending_.empty() && !has_ended() && is_stuck(kMaxStuckTime)) {
    hand_on_first();
    hand_on_settled_steps();
  }
}

// --- which answer --------------------------------------------------------------------------------

StepRecord StepJoin::make_record(const Pending& pending) const {
  StepRecord record;
  record.step = next_step_;
  record.state = pending.state;
  record.is_answer_expected =
      end_ ? end_->is_finished || next_step_ < end_->step : pending_.size() > 1;
  if (is_last(next_step_) || is_last_published())
    settle_last(pending, record);
  else if (const VehicleState* next = next_state())
    is_unanswered(*next) ? settle_unanswered(pending, *next, record)
                         : settle(pending, *next, record);
  return record;
}

/// The sender that flew last, where that was under the name `client`.
const bus::PeerId* StepJoin::find_flyer(const std::string& client) const {
  return flyer_ && flyer_->client == client ? &flyer_->sender : nullptr;
}

bool StepJoin::is_flyer(const std::string& client, const bus::PeerId& sender) const {
  const bus::PeerId* flyer = find_flyer(client);
  return flyer && *flyer == sender;
}

/// The reference of `client`: of the sender that flew last where that was under this name, else of
/// anybody who uses it. A late one is not replaced by what a stranger says.
const StepJoin::Received<Reference>* StepJoin::find_reference(const Pending& pending,
                                                              const std::string& client) const {
  const bus::PeerId* flyer = find_flyer(client);
  for (const auto& reference : pending.references)
    if (reference.sample.client_name() == client && (!flyer || reference.sender == *flyer))
      return &reference;
  return nullptr;
}

/// The first answer under the name `client` of which `is_accepted` holds, with the reference of its
/// sender: of the sender that flew last, else one that is whole, else any.
template <class IsAccepted>
void StepJoin::take_answer(const Pending& pending, const std::string& client,
                           IsAccepted is_accepted, StepRecord& record) const {
  int best = 0;
  for (const auto& command : pending.commands) {
    if (!(command.sample.client_name() == client) || !is_accepted(command.sample)) continue;
    const Reference* reference = find_partner(pending.references, command);
    const int rank = 1 + (reference ? 1 : 0) + (is_flyer(client, command.sender) ? 2 : 0);
    if (rank <= best) continue;
    best = rank;
    record.command = command.sample;
    record.sender = command.sender;
    record.reference = reference ? std::optional(*reference) : std::nullopt;
  }
}

/// No next state tells the force; the final status names the client, and of a finished run the
/// accepted answer is one that ends the mission. Where it comes from him who flew before, that is
/// waited for.
void StepJoin::settle_last(const Pending& pending, StepRecord& record) const {
  const bool is_any_taken = !end_->is_finished;
  const bool is_flyer_known = find_flyer(end_->controller) != nullptr;
  const bool has_flyer_answered =
      std::any_of(pending.commands.begin(), pending.commands.end(),
                  [&](const auto& command) { return is_flyer(end_->controller, command.sender); });
  if (is_any_taken || !is_flyer_known || has_flyer_answered || is_late())
    take_answer(
        pending, end_->controller,
        [&](const ControlCommand& command) { return is_any_taken || ends_mission(command); },
        record);
  if (!is_any_taken || record.is_complete()) return;
  if (!record.command && !pending.commands.empty()) {
    const auto& first = pending.commands.front();
    record.command = first.sample;
    record.sender = first.sender;
    if (const Reference* reference = find_partner(pending.references, first))
      record.reference = *reference;
  }
  if (!record.reference && !pending.references.empty())
    record.reference = pending.references.front().sample;
}

/// The accepted answer is the one of the client that state k + 1 names with the force it says.
void StepJoin::settle(const Pending& pending, const VehicleState& next, StepRecord& record) const {
  const std::string client = next.controller_name().to_string();
  const auto is_accepted = [&](const ControlCommand& command) {
    return are_same_bits(command.f_Q_W_n(), next.answer_f_Q_W_n());
  };
  take_answer(pending, client, is_accepted, record);
  if (record.is_complete() || !is_late()) return;

  // The client died. With its reference, the next state says all; without, an equal answer does.
  const auto* reference = record.command ? nullptr : find_reference(pending, client);
  if (reference)
    record.reference = reference->sample;
  else
    find_stand_in(pending, is_accepted, record);
  if (record.command || next.force_origin() != FORCE_ANSWERED) return;
  record.command = make_command(next, next.answer_f_Q_W_n());
  record.origin = AnswerOrigin::kRebuilt;
}

/// Nobody's answer was in force. What its client would have followed may still come.
void StepJoin::settle_unanswered(const Pending& pending, const VehicleState& next,
                                 StepRecord& record) const {
  const bool is_held = next.force_origin() == FORCE_HELD;
  record.command = make_command(next, is_held ? next.answer_f_Q_W_n() : next.f_Q_W_n());
  record.origin = is_held ? AnswerOrigin::kHeld : AnswerOrigin::kFailSafe;
  if (const auto* reference = find_reference(pending, next.controller_name().to_string()))
    record.reference = reference->sample;
  else if (is_late() && !pending.references.empty())
    record.reference = pending.references.front().sample;
}

// --- handing on ----------------------------------------------------------------------------------

/// A quick look, because most samples that come settle nothing.
bool StepJoin::may_be_settled(const Pending& pending) const {
  if (!pending.state) return false;
  return (!pending.commands.empty() && !pending.references.empty()) ||
         (next_state() && (is_unanswered(*next_state()) || is_late()));
}

bool StepJoin::is_settled(const StepRecord& record) const {
  return record.is_complete() || (record.state && record.is_unanswered() && is_late());
}

void StepJoin::hand_on_settled_steps() {
  while (!pending_.empty() && !has_ended()) {
    const Pending& first = pending_.front();
    const bool is_full = pending_.size() > kMaxPending;
    if (!is_full && !may_be_settled(first)) return;
    const StepRecord record = make_record(first);
    if (!is_full && !is_settled(record)) return;
    hand_on(record);
  }
}

void StepJoin::hand_on_first() { hand_on(make_record(pending_.front())); }

void StepJoin::hand_on(const StepRecord& record) {
  const Pending& first = pending_.front();
  const bool is_taken = record.command && record.origin == AnswerOrigin::kSent;
  dropped_.other_client += first.commands.size() - (is_taken ? 1 : 0);
  if (first.state) --states_pending_;
  if (is_taken) flyer_ = Flyer{record.command->client_name().to_string(), record.sender};
  sink_(record);
  pending_.pop_front();
  ++next_step_;
}

void StepJoin::give_up() {
  if (!has_begun_) begin(next_step_);
  is_giving_up_ = true;
  for (; !end_ && !pending_.empty() && !pending_.back().state; pending_.pop_back())
    dropped_.out_of_range += pending_.back().commands.size() + pending_.back().references.size();
  while (!pending_.empty() && !has_ended()) hand_on_first();
}

}  // namespace sls::record
