#pragma once

#include <optional>
#include <string>

#include "common/sync/patience.hpp"
#include "sim_server/core/participants/participant_watch.hpp"

namespace sls::sim {

/// Says which controllers do not answer, or only with refused answers, and when all answer again.
/// Rules: docs/synchronisation.md, "Waiting for participants".
class AbsenceReport {
 public:
  AbsenceReport(const Fleet& fleet, const ParticipantWatch& watch, RunReport& report,
                const config::Sync& sync);

  /// A vehicle got no answer, and `action` is what is done about it.
  /// @throws std::runtime_error if `action` is kGiveUp.
  void attend(AbsenceAction action, sync::Time now);
  /// The answers to the step in work were taken: announces take-overs and the end of an absence.
  void note_answers(sync::Time now);
  /// @throws std::runtime_error if a client's answer was refused and no other client answers.
  void check_refusals(sync::Time now);
  void note_rest(sync::Duration rest);

 private:
  using Action = AbsenceAction;

  void announce_take_overs(sync::Time now);
  [[noreturn]] void give_up(double waited_s, const std::string& refusals) const;

  const Fleet& fleet_;
  const ParticipantWatch& watch_;
  RunReport& report_;
  const bool is_lockstep_;
  const double give_up_s_;
  std::optional<sync::Patience> wait_;
  std::optional<sync::Time> announced_;  // start of the announced absence
  std::optional<Action> action_;         // the last one that was announced
};

}  // namespace sls::sim
