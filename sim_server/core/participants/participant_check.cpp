#include "sim_server/core/participants/participant_check.hpp"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <tuple>

#include "common/bus/topics.hpp"
#include "common/config/vehicle_ids.hpp"
#include "common/config/yaml_node.hpp"

namespace sls::sim {
namespace {

template <class Ids>
bool flies_any(const Participant& controller, const Ids& ids) {
  return std::any_of(ids.begin(), ids.end(),
                     [&](std::uint32_t id) { return sync::flies_vehicle(controller, id); });
}

bool has_this_contract(const Participant& participant) {
  return participant.contract_sha256() == bus::kContractSha256;
}

}  // namespace

ParticipantCheck::ParticipantCheck(std::uint64_t run_id, const config::Scenario& scenario,
                                   const std::vector<std::uint32_t>& vehicle_ids)
    : run_id_(run_id),
      scenario_sha256_(scenario.sha256),
      vehicle_ids_(vehicle_ids),
      answers_(run_id, vehicle_ids) {}

// --- admission -----------------------------------------------------------------------------------

std::vector<sync::Member> ParticipantCheck::admit_recorders(std::vector<sync::Member> members) {
  const auto is_refused = [](const sync::Member& member) {
    return !has_this_contract(member.announcement);
  };
  members.erase(std::remove_if(members.begin(), members.end(), is_refused), members.end());
  return members;
}

std::vector<sync::Member> ParticipantCheck::admit_controllers(
    const std::vector<sync::Member>& members) {
  std::vector<sync::Member> admitted = admit_recorders(members);
  find_first_libraries(admitted);
  refused_libraries_.clear();
  const auto is_refused = [this](const sync::Member& member) {
    const Library* library = find_other_library(member.announcement);
    if (library && !member.is_gone)
      refused_libraries_[member.peer] =
          describe_field(member, "library_sha256",
                         fmt::format("{} (that of '{}')", to_words(library->sha256),
                                     config::to_printable(library->name, 32)),
                         to_words(member.announcement.library_sha256().to_string())) +
          "; it is refused";
    return library != nullptr;
  };
  admitted.erase(std::remove_if(admitted.begin(), admitted.end(), is_refused), admitted.end());
  return admitted;
}

void ParticipantCheck::find_first_libraries(const std::vector<sync::Member>& controllers) {
  const auto is_earlier = [](const sync::Member& a, const sync::Member& b) {
    return std::tie(a.ready_since, a.peer) < std::tie(b.ready_since, b.peer);
  };
  for (const std::uint32_t id : vehicle_ids_) {
    if (answers_.has_flown(id)) continue;
    const sync::Member* first = nullptr;
    for (const sync::Member& member : controllers) {
      const Participant& announcement = member.announcement;
      const bool is_ready = announcement.ready() && !member.is_gone &&
                            announcement.scenario_sha256() == scenario_sha256_ &&
                            sync::flies_vehicle(announcement, id);
      if (is_ready && (!first || is_earlier(member, *first))) first = &member;
    }
    libraries_.erase(id);
    if (first)
      libraries_[id] = {first->announcement.library_sha256().to_string(),
                        first->announcement.name().to_string()};
  }
}

const ParticipantCheck::Library* ParticipantCheck::find_other_library(
    const Participant& controller) const {
  for (const auto& [id, library] : libraries_)
    if (sync::flies_vehicle(controller, id) && !(controller.library_sha256() == library.sha256))
      return &library;
  return nullptr;
}

// --- findings ------------------------------------------------------------------------------------

const std::map<std::string, std::string>& ParticipantCheck::look(
    const Neighbourhood& neighbourhood) {
  findings_.begin(neighbourhood.now, neighbourhood.is_on_network);
  for (const sync::Member& member : neighbourhood.participants) look_at(member, neighbourhood);
  look_at_strangers(neighbourhood);
  look_at_deadlines(neighbourhood);
  answers_.look(neighbourhood, findings_);
  return findings_.texts();
}

void ParticipantCheck::look_at(const sync::Member& member, const Neighbourhood& neighbourhood) {
  const Participant& announcement = member.announcement;
  if (neighbourhood.other_runs.count(announcement.run_id()) > 0) return;
  if (member.is_presumed_dead(neighbourhood.now)) return;  // that is the cause, not its mistakes
  if (!has_this_contract(announcement)) {
    findings_.add(member, "contract", "contract_sha256", bus::kContractSha256,
                  to_words(announcement.contract_sha256().to_string()));
    return;  // the other fields may have another meaning
  }
  look_at_role(member, neighbourhood);
  if (announcement.role() != ParticipantRole::ROLE_CONTROLLER || announcement.done()) return;
  if (announcement.run_id() != run_id_) return look_at_run(member, neighbourhood);
  if (!(announcement.scenario_sha256() == scenario_sha256_))
    findings_.add(member, "scenario", "scenario_sha256", scenario_sha256_,
                  to_words(announcement.scenario_sha256().to_string()));
  if (const auto vehicles = find_wrong_vehicles(announcement, neighbourhood)) {
    const std::string kind = "vehicle_ids " + *vehicles;
    if (findings_.lasts(member.peer, kind))
      findings_.add(member, kind, "vehicle_ids", config::to_vehicle_ranges(vehicle_ids_),
                    *vehicles);
  }
  const auto library = refused_libraries_.find(member.peer);
  if (library != refused_libraries_.end()) findings_.add(member.peer, "library", library->second);
  look_at_readiness(member, neighbourhood);
}

void ParticipantCheck::look_at_role(const sync::Member& member,
                                    const Neighbourhood& neighbourhood) {
  const ParticipantRole role = member.announcement.role();
  const auto check_text = [&](const char* field, const std::string& text) {
    if (!config::is_utf8(text))
      findings_.add(member, field, field, "UTF-8", "'" + config::to_printable(text, 64) + "'");
  };
  check_text("name", member.announcement.name().to_string());
  check_text("host", member.announcement.host().to_string());
  if (role != ParticipantRole::ROLE_CONTROLLER && role != ParticipantRole::ROLE_RECORDER)
    findings_.add(member, "role", "role", "controller or recorder",
                  std::to_string(static_cast<int>(role)));
  if (role == ParticipantRole::ROLE_RECORDER &&
      neighbourhood.command_writers.count(member.peer) > 0)
    findings_.add(member, "role", "role", "controller, as it writes sls/command", "recorder");
}

/// Of a controller that has announced itself for another run, or for none.
void ParticipantCheck::look_at_run(const sync::Member& member, const Neighbourhood& neighbourhood) {
  if (!may_fly_for_us(member.announcement, neighbourhood)) return;
  const std::uint64_t run_id = member.announcement.run_id();
  const std::string kind = "run_id " + to_words(run_id);
  if (findings_.lasts(member.peer, kind))
    findings_.add(member, kind, "run_id", to_words(run_id_), to_words(run_id));
}

/// Says why a client is not ready, or cannot be.
void ParticipantCheck::look_at_readiness(const sync::Member& member,
                                         const Neighbourhood& neighbourhood) {
  if (neighbourhood.explained.count(member.peer) > 0 || findings_.has_any(member.peer) ||
      neighbourhood.missing_deadlines.count(member.peer) > 0)
    return;
  const bool reads = neighbourhood.state_readers.count(member.peer) > 0;
  const bool writes = neighbourhood.command_writers.count(member.peer) > 0;
  if (member.announcement.ready() && reads && writes) return;
  const std::string missing = reads && writes ? ""
                              : reads         ? "a writer of sls/command"
                              : writes        ? "a reader of sls/state"
                                              : "a reader of sls/state and a writer of sls/command";
  const std::string kind = "ready " + missing;
  if (!findings_.lasts(member.peer, kind)) return;
  if (missing.empty())
    findings_.add(member, kind, "ready", "true, as its endpoints are matched", "false");
  else
    findings_.add(member.peer, kind,
                  describe_participant(member) + ": expected " + missing + ", got none");
}

/// The announced vehicles that no server flies, in words.
std::optional<std::string> ParticipantCheck::find_wrong_vehicles(
    const Participant& announcement, const Neighbourhood& neighbourhood) const {
  if (announcement.vehicle_ids().empty()) return "none";
  std::set<std::uint32_t> wrong(announcement.vehicle_ids().begin(),
                                announcement.vehicle_ids().end());
  for (const std::uint32_t id : vehicle_ids_) wrong.erase(id);
  for (const std::uint32_t id : neighbourhood.other_vehicles) wrong.erase(id);
  if (wrong.empty()) return std::nullopt;
  return config::to_vehicle_ranges({wrong.begin(), wrong.end()});
}

/// Participants that write commands and have not announced themselves.
void ParticipantCheck::look_at_strangers(const Neighbourhood& neighbourhood) {
  for (const auto& [peer, description] : neighbourhood.command_writers) {
    if (neighbourhood.find(peer) || neighbourhood.explained.count(peer) > 0) continue;
    if (findings_.lasts(peer, "announcement"))
      findings_.add(peer, "announcement",
                    description +
                        ": writes sls/command: expected an announcement in sls/participant, got "
                        "none");
  }
}

void ParticipantCheck::look_at_deadlines(const Neighbourhood& neighbourhood) {
  for (const auto& [peer, text] : neighbourhood.missing_deadlines) {
    const sync::Member* member = neighbourhood.find(peer);
    if (member && !may_fly_for_us(member->announcement, neighbourhood)) continue;
    const bool is_certain = member && member->announcement.run_id() == run_id_;
    if (is_certain || findings_.lasts(peer, "deadline")) findings_.add(peer, "deadline", text);
  }
}

/// False for a controller that has joined another server, or that flies other vehicles and may wait
/// for their server.
bool ParticipantCheck::may_fly_for_us(const Participant& controller,
                                      const Neighbourhood& neighbourhood) const {
  if (controller.run_id() == run_id_) return true;
  return neighbourhood.other_runs.count(controller.run_id()) == 0 &&
         (controller.vehicle_ids().empty() || flies_any(controller, vehicle_ids_));
}

}  // namespace sls::sim
