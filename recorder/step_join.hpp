/// Puts the samples of three topics together, step by step and in order. No files, no network here.
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "common/bus/topics.hpp"

namespace sls::record {

/// What is recorded of one step of one vehicle. `command` and `reference` are those of the client
/// whose answer was applied.
struct StepRecord {
  std::uint64_t step = 0;
  std::optional<VehicleState> state;
  std::optional<ControlCommand> command;
  std::optional<Reference> reference;
  bool is_answer_expected = true;  ///< not so for the last step of a run that failed or was lost

  bool is_complete() const { return state && command && reference; }
};

/// Samples dropped on purpose, by reason.
struct DroppedSamples {
  std::uint64_t repeated = 0;      ///< a resent state, a repeated answer, one to a step handed on
  std::uint64_t other_client = 0;  ///< answers of clients whose force was not applied
  std::uint64_t out_of_range = 0;  ///< steps that no run could have reached yet
};

/// Which client's answer to step k was applied is known from state k + 1, or for the last step from
/// the final status. A step is handed on when all before it have been and its three samples are in.
class StepJoin {
 public:
  using Sink = std::function<void(const StepRecord&)>;

  explicit StepJoin(Sink sink) : sink_(std::move(sink)) {}

  void add(const VehicleState& state);
  void add(const ControlCommand& command);
  void add(const Reference& reference);

  /// The run's last step is `last_step`. A finished run has an answer to it, by
  /// `last_controller`; a failed run's last step may have none, and any client's is recorded.
  void set_end(std::uint64_t last_step, bool is_finished, const std::string& last_controller);

  /// True when the end is known and every step up to it has been handed on.
  bool has_ended() const;

  /// Hands on what there is of every step of which anything is known, complete or not.
  void give_up();

  /// All steps up to here have been handed on; −1: none.
  std::int64_t last_step() const { return static_cast<std::int64_t>(next_step_) - 1; }

  const DroppedSamples& dropped() const { return dropped_; }

 private:
  struct Pending {
    std::optional<VehicleState> state;
    std::vector<ControlCommand> commands;  // different ones
    std::vector<Reference> references;     // one per client
  };

  Pending* find(std::uint64_t step, std::uint64_t max_ahead);
  std::optional<std::string> find_applied_client(std::uint64_t step) const;
  StepRecord make_record(const Pending& pending) const;
  void find_stand_in(const Pending& pending, StepRecord& record) const;
  const ControlCommand* find_applied_command(const Pending& pending,
                                             const std::string& client) const;
  bool is_last(std::uint64_t step) const;
  void hand_on_complete_steps();
  void hand_on_first();

  Sink sink_;
  std::deque<Pending> pending_;  // from next_step_ on
  std::uint64_t next_step_ = 0;
  struct End {
    std::uint64_t step;
    bool is_finished;
    std::string controller;
  };
  std::optional<End> end_;
  bool is_giving_up_ = false;
  DroppedSamples dropped_;
};

}  // namespace sls::record
