#include "sim_server/core/participant_check.hpp"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <tuple>
#include <utility>

#include "common/bus/names.hpp"
#include "common/config/vehicle_ids.hpp"
#include "common/config/yaml_node.hpp"

namespace sls::sim {
namespace {

constexpr std::int64_t kStageTolerance_ns = 1'000'000'000;
/// Fewer answers to earlier steps are no mistake: a client that was stopped for a while sends some.
constexpr std::uint64_t kFewOldAnswers = 3;

bool is_defined(ParticipantRole role) {
  return role == ParticipantRole::ROLE_CONTROLLER || role == ParticipantRole::ROLE_RECORDER;
}

std::string describe(const ParticipantCheck::Entry& entry) {
  const ParticipantRole role = entry.announcement.role();
  return fmt::format("{} '{}' on {}", is_defined(role) ? bus::to_string(role) : "participant",
                     config::to_printable(entry.announcement.name().to_string(), 32),
                     config::to_printable(entry.announcement.host().to_string(), 64));
}

/// "controller 'foo' on box: sls/participant FIELD: expected A, got B".
std::string describe_field(const ParticipantCheck::Entry& entry, const char* field,
                           const std::string& expected, const std::string& got) {
  return fmt::format("{}: sls/participant {}: expected {}, got {}", describe(entry), field,
                     expected, got);
}

std::string to_words(const std::string& sha256) {
  return sha256.empty() ? "none" : config::to_printable(sha256, 64);
}

std::string to_words(std::uint64_t run_id) {
  return run_id == 0 ? "0" : fmt::format("{:016x}", run_id);
}

std::string make_key(const bus::PeerId& peer, const std::string& what) {
  std::string key = "run ";
  for (const std::uint8_t byte : peer.bytes) key += fmt::format("{:02x}", byte);
  return key + " " + what;
}

/// True if there is a problem of `peer` already, which may explain others.
bool is_named(const ParticipantCheck::Findings& findings, const bus::PeerId& peer) {
  const std::string prefix = make_key(peer, "");
  const auto own = findings.lower_bound(prefix);
  return own != findings.end() && own->first.compare(0, prefix.size(), prefix) == 0;
}

bool flies_any(const Participant& controller, const std::vector<std::uint32_t>& ids) {
  return std::any_of(ids.begin(), ids.end(),
                     [&](std::uint32_t id) { return sync::flies_vehicle(controller, id); });
}

/// True if nothing but chance decides which of the two flies a vehicle.
bool are_alike(const Participant& a, const Participant& b) {
  const auto& ids = a.vehicle_ids();
  return a.name() == b.name() && a.strength() == b.strength() &&
         flies_any(b, {ids.begin(), ids.end()});
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
      period_ns_(scenario.sync.period_ns) {
  for (const std::uint32_t id : vehicle_ids) {
    const config::Scenario own = config::make_vehicle_scenario(scenario, id);
    Vehicle vehicle;
    vehicle.id = id;
    vehicle.rod_length = own.vehicle.rod_length;
    for (const config::Stage& stage : own.mission) {
      const auto* after = std::get_if<config::LeaveAfter>(&stage.leave);
      vehicle.stages_ns.push_back(after ? std::optional(after->duration_ns) : std::nullopt);
      vehicle.stage_names.push_back(stage.name);
    }
    vehicles_.push_back(std::move(vehicle));
  }
}

bool ParticipantCheck::is_own_vehicle(std::uint32_t id) const {
  return std::binary_search(vehicle_ids_.begin(), vehicle_ids_.end(), id);
}

// --- admission -----------------------------------------------------------------------------------

std::vector<ParticipantCheck::Entry> ParticipantCheck::admit_recorders(
    const std::vector<Entry>& entries) {
  std::vector<Entry> admitted;
  std::copy_if(entries.begin(), entries.end(), std::back_inserter(admitted),
               [](const Entry& entry) { return has_this_contract(entry.announcement); });
  return admitted;
}

std::vector<ParticipantCheck::Entry> ParticipantCheck::admit_controllers(
    const std::vector<Entry>& entries) {
  std::vector<Entry> admitted = admit_recorders(entries);
  find_first_libraries(admitted);
  refused_libraries_.clear();
  const auto is_refused = [this](const Entry& entry) {
    const Library* library = find_other_library(entry.announcement);
    if (library && !entry.is_gone)
      refused_libraries_[entry.peer] =
          describe_field(entry, "library_sha256",
                         fmt::format("{} (that of '{}')", to_words(library->sha256),
                                     config::to_printable(library->name, 32)),
                         to_words(entry.announcement.library_sha256().to_string())) +
          "; it is refused";
    return library != nullptr;
  };
  admitted.erase(std::remove_if(admitted.begin(), admitted.end(), is_refused), admitted.end());
  return admitted;
}

void ParticipantCheck::find_first_libraries(const std::vector<Entry>& controllers) {
  const auto is_earlier = [](const Entry& a, const Entry& b) {
    return a.ready_since != b.ready_since ? a.ready_since < b.ready_since : a.peer < b.peer;
  };
  for (Vehicle& vehicle : vehicles_) {
    if (vehicle.has_flown) continue;
    const Entry* first = nullptr;
    for (const Entry& entry : controllers) {
      const Participant& announcement = entry.announcement;
      const bool is_ready = announcement.ready() && !entry.is_gone &&
                            announcement.scenario_sha256() == scenario_sha256_ &&
                            sync::flies_vehicle(announcement, vehicle.id);
      if (is_ready && (!first || is_earlier(entry, *first))) first = &entry;
    }
    vehicle.library.reset();
    if (first)
      vehicle.library = Library{first->announcement.library_sha256().to_string(),
                                first->announcement.name().to_string()};
  }
}

const ParticipantCheck::Library* ParticipantCheck::find_other_library(
    const Participant& controller) const {
  for (const Vehicle& vehicle : vehicles_)
    if (vehicle.library && sync::flies_vehicle(controller, vehicle.id) &&
        !(controller.library_sha256() == vehicle.library->sha256))
      return &*vehicle.library;
  return nullptr;
}

// --- answers -------------------------------------------------------------------------------------

void ParticipantCheck::note_taken(const OfferedAnswer& offered, const bus::PeerId& sender,
                                  Verdict verdict, const model::ControllerMemory& returned,
                                  const model::Measurement& state) {
  if (!rejections_.empty()) rejections_.erase(sender);
  count(offered, sender, verdict);
  if (verdict != Verdict::kAccepted && verdict != Verdict::kHeld) return;
  const auto id = std::lower_bound(vehicle_ids_.begin(), vehicle_ids_.end(), offered.vehicle_id);
  Vehicle& flown = vehicles_[static_cast<std::size_t>(id - vehicle_ids_.begin())];
  check_memory(flown, offered, sender, returned);
  if (verdict != Verdict::kAccepted) return;
  flown.has_flown = true;
  check_stage(flown, offered, sender);
  check_stage_name(flown, offered, sender);
  check_distance(flown, offered, state);
}

void ParticipantCheck::count(const OfferedAnswer& offered, const bus::PeerId& sender,
                             Verdict verdict) {
  const auto known = answers_.find(sender);
  if (known == answers_.end() && answers_.size() >= kMostSenders) return;
  Answers& answers = known != answers_.end() ? known->second : answers_[sender];
  ++(verdict == Verdict::kDuplicate ? answers.copies : answers.steps);
  if (answers.client_name != offered.client_name) answers.client_name = offered.client_name;
}

void ParticipantCheck::note_empty(const bus::PeerId& sender, std::uint64_t step) {
  see(sender, "empty", [&] {
    return fmt::format("vehicles at step {}: expected at least one answer, got none", step);
  });
}

void ParticipantCheck::note_rejected(const OfferedAnswer& offered, const bus::PeerId& sender,
                                     Verdict verdict, std::uint64_t step) {
  const bool is_of_this_run = offered.run_id == run_id_;
  if (verdict == Verdict::kEarly || (is_of_this_run && offered.step > step))
    see(sender, "early", [&] {
      return "step: " + describe_early(offered.step, verdict == Verdict::kEarly ? step : step + 1);
    });
  if (verdict == Verdict::kContradiction)
    see(sender, "two", [&] {
      return fmt::format("step {}: expected one answer, got two that differ", offered.step);
    });
  if (rejections_.size() >= kMostSenders && rejections_.count(sender) == 0) return;
  Rejections& rejections = rejections_[sender];
  ++rejections.count;
  const bool is_old = verdict == Verdict::kWrongStep && offered.step < step;
  rejections.is_old = rejections.is_old && is_old;
  rejections.defect = describe_defect(offered, verdict, step);
}

/// `unpublished`: the first step whose state had not been published.
std::string ParticipantCheck::describe_early(std::uint64_t got, std::uint64_t unpublished) {
  return unpublished == 0
             ? fmt::format("expected none before a state is published, got {}", got)
             : fmt::format("expected at most {}, the last published, got {}", unpublished - 1, got);
}

std::string ParticipantCheck::describe_defect(const OfferedAnswer& offered, Verdict verdict,
                                              std::uint64_t step) const {
  switch (verdict) {
    case Verdict::kOtherRun:
      return fmt::format("run_id: expected {}, got {}", to_words(run_id_),
                         to_words(offered.run_id));
    case Verdict::kUnknownVehicle:
      return fmt::format("vehicle_id: expected {}, got {}", config::to_vehicle_ranges(vehicle_ids_),
                         offered.vehicle_id);
    case Verdict::kEarly:
      return "step: " + describe_early(offered.step, step);
    case Verdict::kWrongStep:
      return fmt::format("step: expected {}, got {}", step, offered.step);
    default:
      return to_string(verdict);
  }
}

template <class MakeText>
void ParticipantCheck::see(const bus::PeerId& sender, const char* what, MakeText make_text) {
  const auto key = std::pair(sender, std::string(what));
  const auto known = seen_.find(key);
  if (known != seen_.end()) {
    known->second.is_fresh = true;
    return;
  }
  if (seen_.size() < kMostSenders) seen_[key].text = make_text();
}

void ParticipantCheck::check_memory(Vehicle& vehicle, const OfferedAnswer& offered,
                                    const bus::PeerId& sender,
                                    const model::ControllerMemory& returned) {
  const model::ControllerMemory& memory = offered.answer.memory;
  if (memory.stage < returned.stage) {
    vehicle.is_stage_lost = true;
    see(sender, "stage", [&] {
      return fmt::format(
          "controller.stage_index at step {}: expected at least {}, as in the state, got {}",
          offered.step, returned.stage, memory.stage);
    });
  }
  const auto numbers = static_cast<std::size_t>(memory.numbers.size());
  if (numbers < vehicle.numbers)
    see(sender, "numbers", [&] {
      return fmt::format("controller.numbers at step {}: expected {} of them, as before, got {}",
                         offered.step, vehicle.numbers, numbers);
    });
  vehicle.numbers = std::max(vehicle.numbers, numbers);
}

void ParticipantCheck::check_stage(Vehicle& vehicle, const OfferedAnswer& offered,
                                   const bus::PeerId& sender) {
  const std::uint32_t stage = offered.answer.memory.stage;
  if (stage != vehicle.stage) {
    vehicle.stage = stage;
    vehicle.stage_start_step = offered.step;
    return;
  }
  if (offered.answer.mission != model::MissionPhase::kRunning) return;
  // Beyond the last stage the mission must be finished at once.
  const bool is_over = stage >= vehicle.stages_ns.size();
  const auto duration_ns = is_over ? std::optional<std::int64_t>(0) : vehicle.stages_ns[stage];
  if (!duration_ns || offered.step < vehicle.stage_start_step) return;
  const auto steps = static_cast<std::int64_t>(offered.step - vehicle.stage_start_step);
  if (steps * period_ns_ <= *duration_ns + kStageTolerance_ns) return;
  const auto start_ns = static_cast<std::int64_t>(vehicle.stage_start_step) * period_ns_;
  const double end_s = static_cast<double>(start_ns + *duration_ns) * 1e-9;
  // A client that lost the stage cannot advance: the same key prevents a second report.
  see(sender, vehicle.is_stage_lost ? "stage" : "mission", [&] {
    return is_over ? fmt::format(
                         "mission at step {}: expected finished after the last stage, "
                         "which was over at {:g} s, got running",
                         offered.step, end_s)
                   : fmt::format(
                         "controller.stage_index at step {}: expected more than {} (stage "
                         "'{}' was over at {:g} s), got {} and mission running",
                         offered.step, stage, config::to_printable(vehicle.stage_names[stage], 32),
                         end_s, stage);
  });
}

void ParticipantCheck::check_stage_name(Vehicle& vehicle, const OfferedAnswer& offered,
                                        const bus::PeerId& sender) {
  if (offered.answer.stage_name != vehicle.stage_name) {
    vehicle.stage_name = offered.answer.stage_name;
    vehicle.is_stage_name_text = config::is_utf8(vehicle.stage_name);
  }
  if (!vehicle.is_stage_name_text)
    see(sender, "stage name", [&] {
      return fmt::format("reference.stage_name at step {}: expected UTF-8, got '{}'", offered.step,
                         config::to_printable(vehicle.stage_name, 64));
    });
}

void ParticipantCheck::check_distance(Vehicle& vehicle, const OfferedAnswer& offered,
                                      const model::Measurement& state) {
  const Eigen::Vector3d& reference = offered.answer.reference.position;
  const double most = kMostRodLengths * vehicle.rod_length;
  const double load = (state.p_WL - reference).squaredNorm();
  const double quad = (state.p_WQ - reference).squaredNorm();
  if (vehicle.is_far || std::max(load, quad) <= most * most) return;
  vehicle.is_far = true;
  events_.push_back(fmt::format(
      "step {}: vehicle {}: {} {:.4g} m from its reference, expected at most {:g} rod lengths "
      "({:g} m)",
      offered.step, vehicle.id, load > most * most ? "load" : "quadrotor",
      std::sqrt(load > most * most ? load : quad), kMostRodLengths, most));
}

std::string ParticipantCheck::describe_rejections(const bus::PeerId& sender) const {
  const auto found = rejections_.find(sender);
  if (found == rejections_.end()) return "";
  return fmt::format(" ({} of its answers rejected, none taken: {})", found->second.count,
                     found->second.defect);
}

std::vector<std::string> ParticipantCheck::take_events() { return std::exchange(events_, {}); }

// --- findings ------------------------------------------------------------------------------------

bool ParticipantCheck::lasts(const std::string& key, Clock::time_point now,
                             Clock::duration patience) {
  pending_now_.insert(key);
  const auto due = pending_.try_emplace(key, now).first->second + patience;
  if (now >= due) return true;
  if (!next_due_ || due < *next_due_) next_due_ = due;
  return false;
}

bool ParticipantCheck::lasts_despite_losses(const std::string& key,
                                            const Neighbourhood& neighbourhood, bool is_informed) {
  if (!neighbourhood.is_on_network) return lasts(key, neighbourhood.now, kPatience);
  // Another key, because the shorter patience begins when the participant is informed.
  return is_informed ? lasts(key + " informed", neighbourhood.now, kPatienceWithInformed)
                     : lasts(key, neighbourhood.now, kPatienceOnNetwork);
}

ParticipantCheck::Findings ParticipantCheck::look(const Neighbourhood& neighbourhood) {
  Findings findings;
  Senders announced;
  pending_now_.clear();
  next_due_.reset();
  for (const Entry& entry : neighbourhood.participants) {
    announced[entry.peer] = &entry;
    look_at(entry, neighbourhood, findings);
  }
  look_for_twins(neighbourhood, findings);
  look_at_strangers(neighbourhood, announced, findings);
  look_at_valid_answers(neighbourhood, announced, findings);
  look_at_answers(neighbourhood, announced, findings);
  for (auto it = pending_.begin(); it != pending_.end();)
    it = pending_now_.count(it->first) > 0 ? std::next(it) : pending_.erase(it);
  return findings;
}

/// False for a controller that has joined another server, or that flies other vehicles and may wait
/// for their server.
bool ParticipantCheck::may_fly_for_us(const Participant& controller,
                                      const Neighbourhood& neighbourhood) const {
  if (controller.run_id() == run_id_) return true;
  return neighbourhood.other_runs.count(controller.run_id()) == 0 &&
         (controller.vehicle_ids().empty() || flies_any(controller, vehicle_ids_));
}

void ParticipantCheck::look_at(const Entry& entry, const Neighbourhood& neighbourhood,
                               Findings& findings) {
  const Participant& announcement = entry.announcement;
  if (neighbourhood.other_runs.count(announcement.run_id()) > 0) return;
  if (!has_this_contract(announcement)) {
    findings[make_key(entry.peer, "contract")] =
        describe_field(entry, "contract_sha256", bus::kContractSha256,
                       to_words(announcement.contract_sha256().to_string()));
    return;  // the other fields may have another meaning
  }
  look_at_role(entry, neighbourhood, findings);
  if (announcement.role() != ParticipantRole::ROLE_CONTROLLER || announcement.done()) return;
  if (announcement.run_id() != run_id_) {
    const std::string key = make_key(entry.peer, "run_id " + to_words(announcement.run_id()));
    const bool is_informed = neighbourhood.informed.count(entry.peer) > 0;
    const bool may_be_of_run_before = announcement.run_id() != 0 && !neighbourhood.is_on_network;
    if (may_fly_for_us(announcement, neighbourhood) &&
        (may_be_of_run_before ? lasts(key, neighbourhood.now, kPatienceWithRun)
                              : lasts_despite_losses(key, neighbourhood, is_informed)))
      findings[key] =
          describe_field(entry, "run_id", to_words(run_id_), to_words(announcement.run_id()));
    return;
  }
  if (!(announcement.scenario_sha256() == scenario_sha256_))
    findings[make_key(entry.peer, "scenario")] =
        describe_field(entry, "scenario_sha256", scenario_sha256_,
                       to_words(announcement.scenario_sha256().to_string()));
  if (const auto vehicles = find_wrong_vehicles(announcement, neighbourhood)) {
    const std::string key = make_key(entry.peer, "vehicle_ids " + *vehicles);
    if (lasts_despite_losses(key, neighbourhood))
      findings[key] =
          describe_field(entry, "vehicle_ids", config::to_vehicle_ranges(vehicle_ids_), *vehicles);
  }
  const auto library = refused_libraries_.find(entry.peer);
  if (library != refused_libraries_.end())
    findings[make_key(entry.peer, "library")] = library->second;
  look_at_readiness(entry, neighbourhood, findings);
}

void ParticipantCheck::look_at_role(const Entry& entry, const Neighbourhood& neighbourhood,
                                    Findings& findings) {
  const Participant& announcement = entry.announcement;
  const std::string name = announcement.name().to_string(), host = announcement.host().to_string();
  for (const auto& [field, text] : {std::pair("name", name), std::pair("host", host)})
    if (!config::is_utf8(text))
      findings[make_key(entry.peer, field)] =
          describe_field(entry, field, "UTF-8", "'" + config::to_printable(text, 64) + "'");
  if (!is_defined(announcement.role()))
    findings[make_key(entry.peer, "role")] =
        describe_field(entry, "role", "controller or recorder",
                       fmt::format("{}", static_cast<int>(announcement.role())));
  if (announcement.role() == ParticipantRole::ROLE_RECORDER &&
      neighbourhood.command_writers.count(entry.peer) > 0)
    findings[make_key(entry.peer, "role")] =
        describe_field(entry, "role", "controller, as it writes sls/command", "recorder");
}

/// Says why a client is not ready, or cannot be.
void ParticipantCheck::look_at_readiness(const Entry& entry, const Neighbourhood& neighbourhood,
                                         Findings& findings) {
  if (neighbourhood.explained.count(entry.peer) > 0 || is_named(findings, entry.peer) ||
      neighbourhood.missing_deadlines.count(entry.peer) > 0)
    return;
  const bool reads = neighbourhood.state_readers.count(entry.peer) > 0;
  const bool writes = neighbourhood.command_writers.count(entry.peer) > 0;
  if (entry.announcement.ready() && reads && writes) return;
  const std::string missing = reads && writes ? ""
                              : reads         ? "a writer of sls/command"
                              : writes        ? "a reader of sls/state"
                                              : "a reader of sls/state and a writer of sls/command";
  const std::string key = make_key(entry.peer, "ready " + missing);
  // One that is informed knows our endpoints (endpoints.hpp).
  const bool is_informed = missing.empty() && neighbourhood.informed.count(entry.peer) > 0;
  if (!lasts_despite_losses(key, neighbourhood, is_informed)) return;
  findings[key] = missing.empty() ? describe_field(entry, "ready",
                                                   "true, as its endpoints are matched", "false")
                                  : describe(entry) + ": expected " + missing + ", got none";
}

/// The announced vehicles that no server flies, in words.
std::optional<std::string> ParticipantCheck::find_wrong_vehicles(
    const Participant& announcement, const Neighbourhood& neighbourhood) const {
  std::vector<std::uint32_t> wrong;
  for (const std::uint32_t id : announcement.vehicle_ids())
    if (!is_own_vehicle(id) && neighbourhood.other_vehicles.count(id) == 0) wrong.push_back(id);
  if (announcement.vehicle_ids().empty()) return "none";
  if (wrong.empty()) return std::nullopt;
  std::sort(wrong.begin(), wrong.end());
  wrong.erase(std::unique(wrong.begin(), wrong.end()), wrong.end());
  return config::to_vehicle_ranges(wrong);
}

/// A client that was killed stays listed until its lease ends, and one that replaces it under the
/// same name is no mistake. So the earlier of two twins must have announced itself since the later
/// one was ready, or both must have answered a step.
void ParticipantCheck::look_for_twins(const Neighbourhood& neighbourhood, Findings& findings) {
  const auto now = neighbourhood.now;
  if (superseded_) rivals_[*superseded_] = now;
  superseded_.reset();
  for (auto it = rivals_.begin(); it != rivals_.end();)
    it = now - it->second <= kMemory ? std::next(it) : rivals_.erase(it);
  const auto are_rivals = [&](const Entry& earlier, const Entry& later) {
    return rivals_.count({earlier.peer, later.peer}) > 0 ||
           rivals_.count({later.peer, earlier.peer}) > 0 ||
           (earlier.heard >= later.ready_since && now - earlier.heard <= sync::kPresumedDeadAfter);
  };
  for (const Entry& later : neighbourhood.participants)
    for (const Entry& earlier : neighbourhood.participants) {
      const bool is_later =
          std::tie(later.ready_since, later.peer) > std::tie(earlier.ready_since, earlier.peer);
      if (!is_later || !flies(later.announcement) || !flies(earlier.announcement) ||
          !are_alike(earlier.announcement, later.announcement) || !are_rivals(earlier, later))
        continue;
      findings[make_key(later.peer, "twin")] = fmt::format(
          "{}: sls/participant name and strength: expected others than those of {}, got the same: "
          "which of the two flies is arbitrary",
          describe(later), describe(earlier));
    }
}

/// True if the controller is ready to fly in this run.
bool ParticipantCheck::flies(const Participant& controller) const {
  return controller.role() == ParticipantRole::ROLE_CONTROLLER && controller.run_id() == run_id_ &&
         controller.ready() && !controller.done() && has_this_contract(controller) &&
         controller.scenario_sha256() == scenario_sha256_;
}

void ParticipantCheck::look_at_strangers(const Neighbourhood& neighbourhood,
                                         const Senders& announced, Findings& findings) {
  for (const auto& [peer, description] : neighbourhood.command_writers) {
    const std::string key = make_key(peer, "announcement");
    if (announced.count(peer) > 0 || neighbourhood.explained.count(peer) > 0) continue;
    // In the usual order of creation the other writer would have been discovered first.
    const bool has_other_writer = neighbourhood.announcement_writers.count(peer) > 0;
    const bool is_informed = neighbourhood.informed.count(peer) > 0;
    const auto patience = neighbourhood.is_on_network
                              ? (has_other_writer ? kPatienceOnNetwork : kPatienceWithLoss)
                              : (has_other_writer && !is_informed ? kPatienceWithLoss : kPatience);
    // Another key, because the shorter patience begins when the participant is informed.
    if (lasts(is_informed ? key + " informed" : key, neighbourhood.now, patience))
      findings[key] = description +
                      ": writes sls/command: expected an announcement in sls/participant, got none";
  }
  for (const auto& [peer, text] : neighbourhood.missing_deadlines) {
    const auto known = announced.find(peer);
    const Participant* announcement =
        known == announced.end() ? nullptr : &known->second->announcement;
    if (announcement && !may_fly_for_us(*announcement, neighbourhood)) continue;
    const bool is_certain = announcement && announcement->run_id() == run_id_;
    const std::string key = make_key(peer, "deadline");
    if (is_certain || lasts_despite_losses(key, neighbourhood)) findings[key] = text;
  }
}

void ParticipantCheck::look_at_valid_answers(const Neighbourhood& neighbourhood,
                                             const Senders& announced, Findings& findings) {
  for (auto it = answers_.begin(); it != answers_.end();) {
    auto& [peer, answers] = *it;
    const auto known = announced.find(peer);
    if (known == announced.end()) {
      it = answers_.erase(it);
      continue;
    }
    ++it;
    const Entry& entry = *known->second;
    const std::uint64_t steps = std::exchange(answers.steps, 0),
                        copies = std::exchange(answers.copies, 0);
    if (!(entry.announcement.name() == answers.client_name))
      findings[make_key(peer, "client_name")] =
          fmt::format("{}: sls/command client_name: expected '{}', as announced, got '{}'",
                      describe(entry), config::to_printable(entry.announcement.name().to_string()),
                      config::to_printable(answers.client_name));
    const std::string done = make_key(peer, "done"), flood = make_key(peer, "copies");
    if (entry.announcement.done() && steps > 0 && lasts(done, neighbourhood.now, kPatience))
      findings[done] = describe_field(entry, "done", "false, as it still answers", "true");
    const std::uint64_t each = copies / std::max<std::uint64_t>(steps, 1);
    if (each > kMostCopies && lasts(flood, neighbourhood.now, kPatience))
      findings[flood] = fmt::format(
          "{}: sls/command: expected one answer to each state, got over {} copies of each",
          describe(entry), kMostCopies);
  }
}

void ParticipantCheck::look_at_answers(const Neighbourhood& neighbourhood, const Senders& announced,
                                       Findings& findings) {
  const auto now = neighbourhood.now;
  const auto describe_sender = [&](const bus::PeerId& peer) {
    const auto known = announced.find(peer);
    if (known != announced.end()) return describe(*known->second);
    const auto writer = neighbourhood.command_writers.find(peer);
    return writer != neighbourhood.command_writers.end() ? writer->second : std::string();
  };
  for (const auto& [peer, ahead_s] : neighbourhood.stamps_ahead_s) {
    const auto known = announced.find(peer);
    if (known != announced.end() &&
        neighbourhood.other_runs.count(known->second->announcement.run_id()) > 0)
      continue;
    see(peer, "stamp", [seconds = ahead_s] {
      return fmt::format(
          "source timestamp: expected none in the future, got {:.1f} s ahead of our clock",
          seconds);
    });
  }
  for (auto it = seen_.begin(); it != seen_.end();) {
    auto& [key, seen] = *it;
    if (std::exchange(seen.is_fresh, false)) seen.last = now;
    const std::string sender = describe_sender(key.first);
    if (sender.empty() || now - seen.last > kMemory) {
      it = seen_.erase(it);
      continue;
    }
    findings[make_key(key.first, key.second)] = sender + ": sls/command " + seen.text;
    ++it;
  }
  for (auto it = rejections_.begin(); it != rejections_.end();) {
    auto& [peer, rejections] = *it;
    const auto known = announced.find(peer);
    if (known == announced.end()) {  // not announced, which is reported, or gone
      it = rejections_.erase(it);
      continue;
    }
    if (!rejections.since) rejections.since = now;
    const bool is_few = rejections.is_old && rejections.count < kFewOldAnswers;
    if (!is_named(findings, peer) && !is_few && now - *rejections.since >= kPatienceWithAnswers)
      findings[make_key(peer, "rejected")] =
          fmt::format("{}: sls/command: {} answers rejected, none taken: {}",
                      describe(*known->second), rejections.count, rejections.defect);
    ++it;
  }
}

}  // namespace sls::sim
