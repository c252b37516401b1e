#include "recorder/step_join.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>

namespace sls::record {
namespace {

/// A step for which something is missing while so many later states are in has lost it for good;
/// what came after must not wait in memory for it. Answers can be no further ahead: the server
/// keeps within 2,000 steps of what a recorder holds, and whoever answers more than it asked is not
/// heard.
constexpr std::uint64_t kMaxPending = 16384;

/// An applied answer that has not come while so many later states are in was kept back by a client
/// that died; the equal answer of another client, if there is one, stands for it. Well below the
/// lag at which the server waits for the recorder.
constexpr std::size_t kMaxPatience = 1000;

/// No state can be that far ahead either. It bounds the memory a wrong sample can take.
constexpr std::uint64_t kMaxAhead = 65536;

/// Different answers kept for one step: more than any number of clients that fly one vehicle.
constexpr std::size_t kMaxAnswers = 32;

template <class Sample>
const Sample* find_by_client(const std::vector<Sample>& samples, const std::string& client) {
  const auto found = std::find_if(samples.begin(), samples.end(), [&](const Sample& sample) {
    return sample.client_name() == client;
  });
  return found == samples.end() ? nullptr : &*found;
}

/// Of one client and alike in what decides whether it is the one that was applied. Anybody can send
/// under any name, so the name alone does not say that.
bool are_copies(const ControlCommand& a, const ControlCommand& b) {
  return a.client_name() == b.client_name() && a.mission() == b.mission() &&
         std::memcmp(a.f_Q_W_n().data(), b.f_Q_W_n().data(), sizeof a.f_Q_W_n()) == 0;
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

/// Adds `sample` unless a copy of it is there, or too many others.
template <class Sample>
bool add_answer(std::vector<Sample>& samples, const Sample& sample) {
  const bool is_known = std::any_of(samples.begin(), samples.end(),
                                    [&](const Sample& known) { return are_copies(known, sample); });
  if (is_known || samples.size() >= kMaxAnswers) return false;
  samples.push_back(sample);
  return true;
}

}  // namespace

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

void StepJoin::add(const VehicleState& state) {
  Pending* pending = find(state.step(), kMaxAhead);
  if (!pending) return;
  if (pending->state) {
    ++dropped_.repeated;
    return;
  }
  pending->state = state;
  hand_on_complete_steps();
}

void StepJoin::add(const ControlCommand& command) {
  Pending* pending = find(command.step(), kMaxPending);
  if (!pending) return;
  if (!add_answer(pending->commands, command)) ++dropped_.repeated;
  hand_on_complete_steps();
}

void StepJoin::add(const Reference& reference) {
  Pending* pending = find(reference.step(), kMaxPending);
  if (!pending) return;
  if (!add_answer(pending->references, reference)) ++dropped_.repeated;
  hand_on_complete_steps();
}

void StepJoin::set_end(std::uint64_t last_step, bool is_finished,
                       const std::string& last_controller) {
  end_ = {last_step, is_finished, last_controller};
  hand_on_complete_steps();
}

bool StepJoin::has_ended() const { return end_ && next_step_ > end_->step; }

bool StepJoin::is_last(std::uint64_t step) const { return end_ && step == end_->step; }

std::optional<std::string> StepJoin::find_applied_client(std::uint64_t step) const {
  if (is_last(step)) return end_->controller;
  const std::size_t index = static_cast<std::size_t>(step - next_step_) + 1;
  if (index >= pending_.size() || !pending_[index].state) return std::nullopt;
  return pending_[index].state->controller_name().to_string();
}

StepRecord StepJoin::make_record(const Pending& pending) const {
  StepRecord record;
  record.step = next_step_;
  record.state = pending.state;
  record.is_answer_expected =
      end_ ? end_->is_finished || next_step_ < end_->step : pending_.size() > 1;
  const auto client = find_applied_client(next_step_);
  if (!client) return record;
  if (const ControlCommand* command = find_applied_command(pending, *client))
    record.command = *command;
  const bool is_any_taken = is_last(next_step_) && !end_->is_finished;
  if (const auto* reference = find_by_client(
          pending.references, record.command ? record.command->client_name().to_string() : *client))
    record.reference = *reference;
  else if (is_any_taken && !pending.references.empty())
    record.reference = pending.references.front();
  const bool is_kept_back = is_giving_up_ || pending_.size() > kMaxPatience;
  if (!record.is_complete() && is_kept_back && !is_last(next_step_)) find_stand_in(pending, record);
  return record;
}

/// Fills in the first whole answer, of whichever client, with the force that was applied.
void StepJoin::find_stand_in(const Pending& pending, StepRecord& record) const {
  for (const ControlCommand& command : pending.commands) {
    const auto* reference = find_by_client(pending.references, command.client_name().to_string());
    if (!reference || !(pending_[1].state->f_Q_W_n() == command.f_Q_W_n())) continue;
    record.command = command;
    record.reference = *reference;
    return;
  }
}

/// What the client is known to have sent that was applied: the force that state k + 1 says, or the
/// end of the mission.
const ControlCommand* StepJoin::find_applied_command(const Pending& pending,
                                                     const std::string& client) const {
  const auto& commands = pending.commands;
  const bool is_end = is_last(next_step_);
  const auto applied =
      std::find_if(commands.begin(), commands.end(), [&](const ControlCommand& command) {
        if (!(command.client_name() == client)) return false;
        if (is_end) return !end_->is_finished || ends_mission(command);
        return pending_[1].state->f_Q_W_n() == command.f_Q_W_n();
      });
  if (applied != commands.end()) return &*applied;
  const bool is_any_taken = is_end && !end_->is_finished && !commands.empty();
  return is_any_taken ? &commands.front() : nullptr;
}

void StepJoin::hand_on_complete_steps() {
  while (!pending_.empty() && !has_ended()) {
    const Pending& first = pending_.front();
    const bool is_complete = first.state && !first.commands.empty() && !first.references.empty() &&
                             make_record(first).is_complete();
    if (!is_complete && pending_.size() <= kMaxPending) return;
    hand_on_first();
  }
}

void StepJoin::hand_on_first() {
  const StepRecord record = make_record(pending_.front());
  const auto& first = pending_.front();
  dropped_.other_client += first.commands.size() - (record.command ? 1 : 0);
  sink_(record);
  pending_.pop_front();
  ++next_step_;
}

void StepJoin::give_up() {
  is_giving_up_ = true;
  while (!pending_.empty() && !has_ended()) hand_on_first();
}

}  // namespace sls::record
