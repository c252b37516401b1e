/// Judges every answer: accepts one per step, and gives the cause if it rejects one. No network
/// here.
/// Rules: docs/synchronisation.md, "Acceptance of answers" and "Standby and take-over".
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "common/bus/peer.hpp"
#include "sim_server/core/answers/judgement.hpp"
#include "sls.h"

namespace sls::sim {

enum class Verdict {
  kAccepted,    ///< the answer to the awaited step; it will be applied
  kHeld,        ///< a valid answer of a client that is not the awaited one: kept for a take-over
  kDuplicate,   ///< copy of an accepted or held command
  kSuperseded,  ///< valid, but another client's answer was taken
  kLate,        ///< the first valid answer to a step that went by without one
  kNotFinite,
  kForceLimit,
  kOtherRun,
  kEarly,  ///< it answers a state that had not been published
  kWrongStep,
  kContradiction,  ///< another answer of the same client to the same step
  kUnknownVehicle,
  kUnknownClient,
  kUndefined,  ///< this and the next three are counted in `rejected_fault`
  kErrorCode,
  kUnknownStage,
  kEarlyEnd,  ///< of the mission
};

/// Defect of a rejected command, for messages. Empty for the first five verdicts.
const char* to_string(Verdict verdict);

/// One vehicle's part of a sample of sls/command.
struct OfferedAnswer {
  std::uint64_t run_id = 0;
  std::uint64_t step = 0;
  std::uint32_t vehicle_id = 0;
  std::string client_name;
  bool is_early = false;  ///< it came before the state of its step was published
  model::Answer answer;
};

/// A client that announced itself ready to fly the vehicle.
struct ReadyClient {
  bus::PeerId peer;
  std::string name;
  std::int32_t strength = 0;
  bool is_gone = false;  ///< awaited only if no other client is there; its next answer counts
};

class CommandGate {
 public:
  CommandGate(std::uint64_t run_id, std::uint32_t vehicle_id, const AnswerLimits& limits);

  /// Sets the clients that may answer. Clients that stay keep their records. One that joins others
  /// in flight is new: it is awaited once it has answered.
  void set_clients(const std::vector<ReadyClient>& clients);

  /// Awaits the answers to `step` from now on. Steps are awaited in order. A step that went by
  /// without an accepted answer (in real time, or without a controller) may still get a late one.
  void expect(std::uint64_t step);

  /// Judges one answer and counts it.
  Verdict offer(const OfferedAnswer& offered, const bus::PeerId& sender);

  /// The accepted answer to the awaited step, once there is one.
  const std::optional<OfferedAnswer>& accepted() const { return accepted_; }

  /// The last answer to the awaited step that was refused because of its content.
  const std::optional<OfferedAnswer>& refused() const { return refused_; }

  /// The client whose answer is awaited: the strongest that is neither new, gone, silent nor
  /// refused. If there is none, the strongest that is not refused, of those that are not gone
  /// first.
  std::optional<ReadyClient> awaited_client() const;

  /// Set when the awaited step's answer came from another client than the last accepted answer.
  struct TakeOver {
    std::string from;
    std::string to;
  };
  const std::optional<TakeOver>& take_over() const { return take_over_; }

  /// Counts a miss: the awaited client did not answer the awaited step. Returns its misses in a
  /// row.
  int count_miss();

  /// If there is another client to await: declares the awaited one silent, awaits the next one and
  /// returns true. A silent client is skipped until it answers an awaited step again.
  bool pass_over_silent_client();

  /// The refused answers of the clients, if none is left to answer the awaited step. Nothing while
  /// an answer can still come.
  std::optional<std::string> refusal() const;

  /// Describes the refused answers to the awaited step and to steps that went by since the last
  /// accepted answer. Empty if the awaited step has its answer.
  std::string describe_refusals() const;

  /// The client has sent a sample that answers no vehicle.
  void note_sign_of_life(const bus::PeerId& sender) {
    if (Client* client = find_client(sender)) ++client->answers;
  }
  /// Calls `note(peer, answers, is_missing)` for each client: the number of its answers so far, and
  /// whether its answer to the last awaited step is missing.
  template <class Note>
  void for_each_client(Note note) const {
    for (const Client& client : clients_)
      note(client.identity.peer, client.answers, has_begun_ && client.answered_end <= step_);
  }

  const SyncCounters& counters() const { return counters_; }
  SyncCounters& counters() { return counters_; }

 private:
  struct Client {
    bool is_refused(std::uint64_t step) const { return !refusal.empty() && refused_step == step; }
    bool is_expected() const { return !is_new && !silent && !identity.is_gone; }

    ReadyClient identity;
    bool is_new = false;  // joined in flight, beside others, and has not answered yet
    bool silent = false;
    int misses = 0;                     // steps in a row that it did not answer
    std::uint64_t answers = 0;          // received, also refused ones
    std::uint64_t answered_end = 0;     // the first step after the last one with a valid answer
    std::string refusal;                // why its last answer was refused
    std::uint64_t refused_step = 0;     // the step of that answer
    std::optional<OfferedAnswer> held;  // its first valid answer to the awaited step
  };

  Verdict judge(const OfferedAnswer& offered, const bus::PeerId& sender);
  Verdict judge_past(const OfferedAnswer& offered, const bus::PeerId& sender);
  bool is_of_distant_standby(const OfferedAnswer& offered, const bus::PeerId& sender);
  void count(Verdict verdict);
  void note_refusal(Client& client, const OfferedAnswer& offered, Defect defect);
  void settle();
  void drop_held();
  Client* find_client(const bus::PeerId& peer);
  const Client* find_awaited() const;

  const std::uint64_t run_id_;
  const std::uint32_t vehicle_id_;
  const AnswerLimits limits_;

  std::uint64_t step_ = 0;
  bool has_begun_ = false;       // a step has been awaited
  std::vector<Client> clients_;  // strongest first
  std::optional<OfferedAnswer> accepted_;
  std::optional<OfferedAnswer> refused_;
  bus::PeerId accepted_from_;
  std::optional<ReadyClient> flyer_;  // sender of the last accepted answer
  std::optional<TakeOver> take_over_;
  struct Past {
    bus::PeerId sender;
    Eigen::Vector3d force;
  };
  // First answer to each of the last steps, to recognise copies; nothing for a step without one.
  std::map<std::uint64_t, std::optional<Past>> past_;
  SyncCounters counters_;
};

}  // namespace sls::sim
