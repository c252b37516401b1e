#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>

#include "sim_server/core/answers/command_sample.hpp"
#include "sim_server/core/participants/participant_check.hpp"
#include "sim_server/core/participants/presence.hpp"
#include "sim_server/core/participants/roster.hpp"
#include "sim_server/core/participants/stamp_check.hpp"
#include "sim_server/core/participants/surroundings.hpp"
#include "sim_server/core/report/run_report.hpp"
#include "sim_server/core/step/fleet.hpp"

namespace sls::sim {

/// Knows the participants of a run: who is there, who may answer, and what they do wrong.
class ParticipantWatch {
 public:
  ParticipantWatch(const config::Scenario& scenario, std::uint64_t run_id, Fleet& fleet,
                   RunReport& report);

  const Roster& roster() const { return roster_; }
  AnswerCheck& answers() { return check_.answers(); }
  /// A sample of sls/command came.
  void note_arrival(const CommandSample& sample) {
    stamps_.note(sample.sender, sample.written, [&] { return sample.arrived.wall; });
  }
  /// Step 0 is about to be published.
  void begin(sync::Time now) { roster_.began = now; }

  /// Refreshes the roster and the clients of the command gates, if an announcement has come or the
  /// roster is old. True if it did. `awaits_answers`: the step in work was published.
  bool refresh_if_due(const Surroundings& around, bool awaits_answers, sync::Time now);

  /// True if an announcement has come that the roster does not know.
  bool has_news(const Surroundings& around) const {
    return around.members_version() != members_version_;
  }
  /// True if the participants should be checked for mistakes before the next status is due.
  bool is_look_due(const Surroundings& around, sync::Time now) const;
  /// Looks for mistakes of the participants; they become the problem of the report.
  void look(Surroundings& around, sync::Time now);
  /// Announces a recorder that is silent although it is behind.
  void report_silent_recorder(sync::Time now);

  /// Names the controllers whose answers are awaited.
  std::string name_awaited_controllers() const;

 private:
  std::map<bus::PeerId, Answering> collect_answering(bool awaits_answers);
  std::string name_awaited_controller(const Vehicle& vehicle) const;

  const std::uint64_t run_id_;
  const std::string scenario_sha256_;
  Fleet& fleet_;
  RunReport& report_;
  Roster roster_;
  ParticipantCheck check_;
  Presence presence_;
  StampCheck stamps_;
  std::uint64_t members_version_ = 0;  // of the roster
  std::uint64_t roster_step_ = 0;
  std::uint64_t looked_at_version_ = 0;  // of the members, at the last look
  std::uint64_t problems_version_ = 0;
  sync::Time look_time_{};
  std::optional<sync::Time> recorder_report_time_;
};

}  // namespace sls::sim
