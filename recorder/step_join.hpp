/// Puts the samples of three topics together, step by step and in order. No files, no network, no
/// clock here.
#pragma once

#include <chrono>
#include <cstdint>
#include <deque>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "common/bus/peer.hpp"
#include "common/bus/topics.hpp"

namespace sls::record {

/// Where the command of a step comes from.
enum class AnswerOrigin {
  kSent,     ///< the accepted command, or an equal one of another client
  kRebuilt,  ///< accepted, but its sample died with its client: made from the next state
  kHeld,     ///< none was in force, an older answer was held: made from the next state
  kFailSafe  ///< none was in force, the server's fail-safe was: made from the next state
};

/// What is recorded of one step of one vehicle. `command` and `reference` are those of the client
/// whose answer was accepted.
struct StepRecord {
  std::uint64_t step = 0;
  std::optional<VehicleState> state;
  std::optional<ControlCommand> command;
  std::optional<Reference> reference;
  AnswerOrigin origin = AnswerOrigin::kSent;  ///< of `command`
  bus::PeerId sender;                         ///< of `command`, where it was sent
  bool is_answer_expected = true;  ///< not so for the last step of a run that failed or was lost

  bool is_complete() const { return state && command && reference; }
  bool is_unanswered() const {
    return origin == AnswerOrigin::kHeld || origin == AnswerOrigin::kFailSafe;
  }
};

/// Samples dropped on purpose, by reason.
struct DroppedSamples {
  std::uint64_t repeated = 0;      ///< a resent state, a repeated answer, one to a step handed on
  std::uint64_t other_client = 0;  ///< answers of clients whose force was not applied
  std::uint64_t out_of_range = 0;  ///< of steps that no run could have reached yet, or did
};

/// Which client's answer to step k was accepted is known from state k + 1, or for the last step
/// from the final status. A step is handed on when all before it have been and its three samples
/// are in; what dying or late clients keep back is not waited for without end (README.md).
class StepJoin {
 public:
  using Duration = std::chrono::steady_clock::duration;
  using Sink = std::function<void(const StepRecord&)>;
  /// Called where steps [from, to] were over before the first state that came.
  using GapSink = std::function<void(std::uint64_t from, std::uint64_t to)>;

  /// Begins with `first_step`, or with the first state that comes if that is a later one.
  explicit StepJoin(Sink sink, std::uint64_t first_step = 0, GapSink gap_sink = {})
      : sink_(std::move(sink)), gap_sink_(std::move(gap_sink)), next_step_(first_step) {}

  void add(const VehicleState& state);
  /// Anybody can send under any client's name: a command and a reference belong together where they
  /// come from one `sender`.
  void add(const ControlCommand& command, const bus::PeerId& sender = {});
  void add(const Reference& reference, const bus::PeerId& sender = {});

  /// The run's last step is `last_step`. A finished run has an answer to it, by
  /// `last_controller`; a failed run's last step may have none, and any client's is recorded.
  void set_end(std::uint64_t last_step, bool is_finished, const std::string& last_controller);

  /// Tells how much time has passed. A step that waits for an answer while later states have been
  /// in for 10 s has lost it for good, and is handed on as it is.
  void pass_time(Duration elapsed);

  /// What the first step waits for, where later states have been in for `patience`: in words.
  std::optional<std::string> describe_stuck(Duration patience) const;

  /// True when the end is known and every step up to it has been handed on.
  bool has_ended() const;

  /// Hands on what there is of every step up to the end or, where that is not known, the last one
  /// with a state, complete or not: an answer, which anybody may send, shows no step.
  void give_up();

  /// All steps up to here have been handed on; −1: none.
  std::int64_t last_step() const { return static_cast<std::int64_t>(next_step_) - 1; }

  const DroppedSamples& dropped() const { return dropped_; }

 private:
  template <class Sample>
  struct Received {
    Sample sample;
    bus::PeerId sender;
  };
  using Commands = std::vector<Received<ControlCommand>>;
  using References = std::vector<Received<Reference>>;
  struct Pending {
    std::optional<VehicleState> state;
    Commands commands;      // different ones
    References references;  // one per sender and client
    Duration state_time{};  // on the clock of pass_time
  };
  struct Flyer {
    std::string client;
    bus::PeerId sender;
  };

  void begin(std::uint64_t first_state);
  template <class Sample>
  void keep_early(std::vector<Received<Sample>>& early, const Sample& sample,
                  const bus::PeerId& sender);
  Pending* find(std::uint64_t step, std::uint64_t max_ahead);
  const VehicleState* next_state() const;
  bool is_last(std::uint64_t step) const;
  bool is_last_published() const;
  bool is_stuck(Duration patience) const;
  bool is_late() const;
  bool may_be_settled(const Pending& pending) const;

  StepRecord make_record(const Pending& pending) const;
  const bus::PeerId* find_flyer(const std::string& client) const;
  bool is_flyer(const std::string& client, const bus::PeerId& sender) const;
  const Received<Reference>* find_reference(const Pending& pending,
                                            const std::string& client) const;
  template <class IsAccepted>
  void take_answer(const Pending& pending, const std::string& client, IsAccepted is_accepted,
                   StepRecord& record) const;
  void settle_last(const Pending& pending, StepRecord& record) const;
  void settle(const Pending& pending, const VehicleState& next, StepRecord& record) const;
  void settle_unanswered(const Pending& pending, const VehicleState& next,
                         StepRecord& record) const;
  bool is_settled(const StepRecord& record) const;
  void hand_on_settled_steps();
  void hand_on_first();
  void hand_on(const StepRecord& record);

  Sink sink_;
  GapSink gap_sink_;
  bool has_begun_ = false;          // a state has come
  Commands early_commands_;         // before that
  References early_references_;     // likewise
  std::deque<Pending> pending_;     // from next_step_ on
  std::size_t states_pending_ = 0;  // among them
  std::uint64_t next_step_;
  struct End {
    std::uint64_t step;
    bool is_finished;
    std::string controller;
  };
  std::optional<End> end_;
  std::optional<Flyer> flyer_;  // whose answer was recorded last
  bool is_giving_up_ = false;
  Duration clock_{};
  DroppedSamples dropped_;
};

}  // namespace sls::record
