/// Mistakes of the participants of a run, in words: docs/synchronisation.md, "Mistakes of
/// participants". No network and no clock here.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "common/config/scenario.hpp"
#include "common/sync/membership.hpp"
#include "sim_server/core/answer_check.hpp"
#include "sim_server/core/findings.hpp"
#include "sim_server/core/surroundings.hpp"

namespace sls::sim {

/// Compares what participants announce, and their endpoints, with the run. An AnswerCheck does the
/// same with their answers.
class ParticipantCheck {
 public:
  ParticipantCheck(std::uint64_t run_id, const config::Scenario& scenario,
                   const std::vector<std::uint32_t>& vehicle_ids);

  /// The members (of this run) that may take part: they use this contract, and a controller has
  /// loaded the library with which its vehicles are flown.
  std::vector<sync::Member> admit_controllers(const std::vector<sync::Member>& members);
  static std::vector<sync::Member> admit_recorders(std::vector<sync::Member> members);

  AnswerCheck& answers() { return answers_; }
  const AnswerCheck& answers() const { return answers_; }

  /// All current mistakes. Call a few times a second.
  const std::map<std::string, std::string>& look(const Neighbourhood& neighbourhood);
  /// When `look` is due again, because a pending problem will then have lasted too long.
  const std::optional<sync::Time>& next_due() const { return findings_.next_due(); }

 private:
  struct Library {
    std::string sha256;
    std::string name;  // of the client that has loaded it
  };

  void find_first_libraries(const std::vector<sync::Member>& controllers);
  /// The library that `controller` should have loaded; null if it has loaded the right one.
  const Library* find_other_library(const Participant& controller) const;

  void look_at(const sync::Member& member, const Neighbourhood& neighbourhood);
  void look_at_role(const sync::Member& member, const Neighbourhood& neighbourhood);
  void look_at_run(const sync::Member& member, const Neighbourhood& neighbourhood);
  void look_at_readiness(const sync::Member& member, const Neighbourhood& neighbourhood);
  void look_at_strangers(const Neighbourhood& neighbourhood);
  void look_at_deadlines(const Neighbourhood& neighbourhood);

  bool may_fly_for_us(const Participant& controller, const Neighbourhood& neighbourhood) const;
  std::optional<std::string> find_wrong_vehicles(const Participant& announcement,
                                                 const Neighbourhood& neighbourhood) const;

  const std::uint64_t run_id_;
  const std::string scenario_sha256_;
  const std::vector<std::uint32_t> vehicle_ids_;
  AnswerCheck answers_;
  Findings findings_;
  /// By vehicle: of the client that flies or, before that, of the first one that is ready and not
  /// gone.
  std::map<std::uint32_t, Library> libraries_;
  std::map<bus::PeerId, std::string> refused_libraries_;  // of clients that are not admitted
};

}  // namespace sls::sim
