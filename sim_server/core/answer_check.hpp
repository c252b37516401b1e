/// Mistakes in the answers of controllers: docs/synchronisation.md, "Mistakes of participants".
#pragma once

#include <chrono>
#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "sim_server/core/command_gate.hpp"
#include "sim_server/core/findings.hpp"
#include "sim_server/core/surroundings.hpp"

namespace sls::sim {

/// Notes what each answer does wrong while the run flies, and says it when the server looks around.
class AnswerCheck {
 public:
  /// A problem of answers lasts this long after the last answer that shows it.
  static constexpr std::chrono::milliseconds kMemory{2000};
  static constexpr std::size_t kMostSenders = sync::Membership::kMostMembers;
  /// More copies of each answer are a flood. States that are sent again cause some.
  static constexpr std::uint64_t kMostCopies = 30;

  AnswerCheck(std::uint64_t run_id, const std::vector<std::uint32_t>& vehicle_ids)
      : run_id_(run_id), vehicle_ids_(vehicle_ids) {}

  /// The answer of `peer` was accepted, held, late, a copy or superseded.
  void note_taken(const OfferedAnswer& offered, const bus::PeerId& peer, Verdict verdict);
  /// The answer of `peer` was rejected while `step` was in work.
  void note_rejected(const OfferedAnswer& offered, const bus::PeerId& peer, Verdict verdict,
                     std::uint64_t step);
  /// A sample of `peer` for this run and `step` answers no vehicle.
  void note_empty(const bus::PeerId& peer, std::uint64_t step);

  void look(const Neighbourhood& neighbourhood, Findings& findings);

  bool has_flown(std::uint32_t vehicle_id) const { return flown_.count(vehicle_id) > 0; }
  /// " (57 of its answers rejected, none taken: …)", for messages about an awaited client; empty if
  /// its last answer was taken.
  std::string describe_rejections(const bus::PeerId& peer) const;

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

  Sender& find_sender(const bus::PeerId& peer);
  std::string describe_defect(const OfferedAnswer& offered, Verdict verdict,
                              std::uint64_t step) const;
  void look_at(Sender& sender, const sync::Member& member, sync::Time now, Findings& findings);

  const std::uint64_t run_id_;
  const std::vector<std::uint32_t> vehicle_ids_;
  std::set<std::uint32_t> flown_;  // vehicles with an accepted answer
  std::map<bus::PeerId, Sender> senders_;
};

}  // namespace sls::sim
