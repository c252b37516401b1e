#include "recorder/step_join.hpp"

#include <algorithm>

namespace sls::record {
namespace {

/// No step can be that far ahead: the server keeps within 2,000 of what a recorder holds. It bounds
/// the memory a wrong sample can take.
constexpr std::uint64_t kMaxAhead = 65536;

/// A step for which something is missing while so many later ones are in has lost it for good; what
/// came after must not wait in memory for it.
constexpr std::size_t kMaxPending = 16384;

template <class Sample>
const Sample* find_by_client(const std::vector<Sample>& samples, const std::string& client) {
  const auto found = std::find_if(samples.begin(), samples.end(), [&](const Sample& sample) {
    return sample.client_name() == client;
  });
  return found == samples.end() ? nullptr : &*found;
}

/// Adds `sample` unless its client already has one there.
template <class Sample>
bool add_per_client(std::vector<Sample>& samples, const Sample& sample) {
  if (find_by_client(samples, sample.client_name().to_string())) return false;
  samples.push_back(sample);
  return true;
}

}  // namespace

StepJoin::Pending* StepJoin::find(std::uint64_t step) {
  if (step < next_step_) {
    ++dropped_.repeated;
    return nullptr;
  }
  if (step - next_step_ > kMaxAhead) {
    ++dropped_.out_of_range;
    return nullptr;
  }
  const std::size_t index = static_cast<std::size_t>(step - next_step_);
  if (index >= pending_.size()) pending_.resize(index + 1);
  return &pending_[index];
}

void StepJoin::add(const VehicleState& state) {
  Pending* pending = find(state.step());
  if (!pending) return;
  if (pending->state) {
    ++dropped_.repeated;
    return;
  }
  pending->state = state;
  hand_on_complete_steps();
}

void StepJoin::add(const ControlCommand& command) {
  Pending* pending = find(command.step());
  if (!pending) return;
  if (!add_per_client(pending->commands, command)) ++dropped_.repeated;
  hand_on_complete_steps();
}

void StepJoin::add(const Reference& reference) {
  Pending* pending = find(reference.step());
  if (!pending) return;
  if (!add_per_client(pending->references, reference)) ++dropped_.repeated;
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
  const auto client = find_applied_client(next_step_);
  if (!client) return record;
  const bool is_end = is_last(next_step_);
  if (const auto* command = find_by_client(pending.commands, *client)) {
    // The force that state k + 1 says was applied is the one this client answered, or the row would
    // be wrong.
    if (is_end || pending_[1].state->f_Q_W_n() == command->f_Q_W_n()) record.command = *command;
  } else if (is_end && !end_->is_finished && !pending.commands.empty()) {
    record.command = pending.commands.front();
  }
  if (const auto* reference = find_by_client(pending.references, *client))
    record.reference = *reference;
  else if (is_end && !end_->is_finished && !pending.references.empty())
    record.reference = pending.references.front();
  return record;
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
  while (!pending_.empty() && !has_ended()) hand_on_first();
}

}  // namespace sls::record
