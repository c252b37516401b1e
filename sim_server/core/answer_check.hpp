/// Mistakes in the answers of controllers: docs/synchronisation.md, "Mistakes of participants".
#pragma once

#include <chrono>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "common/config/scenario.hpp"
#include "common/model/measurement.hpp"
#include "sim_server/core/command_gate.hpp"
#include "sim_server/core/findings.hpp"
#include "sim_server/core/surroundings.hpp"

namespace sls::sim {

/// Notes what each answer does wrong while the run flies, and says it when the server looks around.
class AnswerCheck {
 public:
  /// Patience with rejected answers while none is taken.
  static constexpr std::chrono::milliseconds kPatienceWithAnswers{800};
  /// A problem of answers lasts this long after the last answer that shows it.
  static constexpr std::chrono::milliseconds kMemory{2000};
  static constexpr std::size_t kMostSenders = sync::Membership::kMostMembers;
  /// More copies of each answer are a flood. States that are sent again cause some.
  static constexpr std::uint64_t kMostCopies = 30;
  /// Largest distance of load and quadrotor from the reference, in rod lengths.
  static constexpr double kMostRodLengths = 50.0;

  AnswerCheck(std::uint64_t run_id, const config::Scenario& scenario,
              const std::vector<std::uint32_t>& vehicle_ids);

  /// The answer of `peer` was accepted, held, late, a copy or superseded. `returned` is the
  /// controller state in the state sample of the step in work; `state` is the state of the vehicle
  /// at that step.
  void note_taken(const OfferedAnswer& offered, const bus::PeerId& peer, Verdict verdict,
                  const model::ControllerMemory& returned, const model::Measurement& state);
  /// The answer of `peer` was rejected while `step` was in work.
  void note_rejected(const OfferedAnswer& offered, const bus::PeerId& peer, Verdict verdict,
                     std::uint64_t step);
  /// A sample of `peer` for this run and `step` answers no vehicle.
  void note_empty(const bus::PeerId& peer, std::uint64_t step);
  /// Answers of both clients to one step arrived; that of `winner` was taken.
  void note_superseded(const bus::PeerId& loser, const bus::PeerId& winner) {
    superseded_.emplace(loser, winner);
  }
  /// The last such pair since the last call.
  std::optional<std::pair<bus::PeerId, bus::PeerId>> take_superseded() {
    return std::exchange(superseded_, std::nullopt);
  }

  void look(const Neighbourhood& neighbourhood, Findings& findings);

  bool has_flown(std::uint32_t vehicle_id) const { return vehicles_.at(vehicle_id).has_flown; }
  /// " (57 of its answers rejected, none taken: …)", for messages about an awaited client; empty if
  /// its last answer was taken.
  std::string describe_rejections(const bus::PeerId& peer) const;
  /// Events since the last call, such as a vehicle far from its reference.
  std::vector<std::string> take_events() { return std::exchange(events_, {}); }

 private:
  /// A mistake in answers.
  struct Seen {
    std::string text;  // without the sender
    bool is_fresh = true;
    sync::Time last;
  };
  /// The mistakes of a participant, and its answers.
  struct Sender {
    std::map<std::string, Seen> seen;  // by kind
    // Answers that were not rejected:
    std::optional<std::string> client_name;  // in the last one
    std::uint64_t steps = 0;                 // since the last look, times vehicles
    std::uint64_t copies = 0;                // since the last look
    // Answers that were rejected, none taken since:
    std::uint64_t rejected = 0;
    std::string defect;  // of the last one
    bool is_old = true;  // all were answers to earlier steps
    std::optional<sync::Time> rejected_since;
  };
  struct Vehicle {
    double rod_length = 0.0;
    std::vector<config::Stage> mission;
    std::uint32_t stage = 0;             // in the last accepted answer
    std::uint64_t stage_start_step = 0;  // of the first answer with that stage
    bool is_stage_lost = false;          // an answer was behind the state's stage
    std::size_t numbers = 0;             // largest count in an answer so far
    bool is_far = false;
    bool has_flown = false;
  };

  Sender& find_sender(const bus::PeerId& peer);
  void check_memory(Vehicle& vehicle, const OfferedAnswer& offered, Sender& sender,
                    const model::ControllerMemory& returned);
  void check_stage(Vehicle& vehicle, const OfferedAnswer& offered, Sender& sender);
  void check_distance(Vehicle& vehicle, const OfferedAnswer& offered,
                      const model::Measurement& state);
  std::string describe_defect(const OfferedAnswer& offered, Verdict verdict,
                              std::uint64_t step) const;
  void look_at(Sender& sender, const sync::Member& member, sync::Time now, Findings& findings);

  const std::uint64_t run_id_;
  const std::vector<std::uint32_t> vehicle_ids_;
  const std::int64_t period_ns_;
  std::map<std::uint32_t, Vehicle> vehicles_;
  std::map<bus::PeerId, Sender> senders_;
  std::optional<std::pair<bus::PeerId, bus::PeerId>> superseded_;
  std::vector<std::string> events_;
};

}  // namespace sls::sim
