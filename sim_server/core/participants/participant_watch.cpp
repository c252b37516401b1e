#include "sim_server/core/participants/participant_watch.hpp"

#include <spdlog/fmt/fmt.h>

#include <chrono>
#include <vector>

namespace sls::sim {
namespace {

using namespace std::chrono_literals;

constexpr auto kRosterTime = 100ms;    // between checks for departure and silence
constexpr auto kLookInterval = 100ms;  // least time between checks of participants
constexpr auto kRecorderSilence = 1s;  // until a recorder that is behind is reported
constexpr auto kReportInterval = 5s;   // between reports of the same silence

}  // namespace

ParticipantWatch::ParticipantWatch(const config::Scenario& scenario, std::uint64_t run_id,
                                   Fleet& fleet, RunReport& report)
    : run_id_(run_id),
      scenario_sha256_(scenario.sha256),
      fleet_(fleet),
      report_(report),
      check_(run_id, scenario, fleet.ids()) {}

bool ParticipantWatch::refresh_if_due(const Surroundings& around, bool awaits_answers,
                                      sync::Time now) {
  const std::uint64_t version = around.members_version();
  if (version == members_version_ && now - roster_.now <= kRosterTime) return false;
  members_version_ = version;
  auto controllers = around.find_members(ParticipantRole::ROLE_CONTROLLER, run_id_);
  presence_.look(controllers, collect_answering(awaits_answers), now);
  roster_.controllers = check_.admit_controllers(controllers);
  roster_.recorders = ParticipantCheck::admit_recorders(
      around.find_members(ParticipantRole::ROLE_RECORDER, run_id_));
  roster_.now = now;
  fleet_.set_clients(roster_, scenario_sha256_);
  return true;
}

std::map<bus::PeerId, Answering> ParticipantWatch::collect_answering(bool awaits_answers) {
  // A client that has not answered need not do so while the run rests or waits for a recorder.
  const bool is_flying = awaits_answers || roster_step_ != fleet_.step();
  roster_step_ = fleet_.step();
  std::map<bus::PeerId, Answering> answering;
  for (const auto& vehicle : fleet_.vehicles())
    vehicle->gate.for_each_client(
        [&](const bus::PeerId& peer, std::uint64_t answers, bool is_missing) {
          Answering& sum = answering[peer];
          sum.answers += answers;
          sum.is_asked = sum.is_asked || (is_missing && is_flying);
        });
  return answering;
}

bool ParticipantWatch::is_look_due(const Surroundings& around, sync::Time now) const {
  const auto& due = check_.next_due();
  const bool is_news = around.problems_version() != problems_version_ ||
                       around.members_version() != looked_at_version_;
  return now - look_time_ >= kLookInterval && (is_news || (due && now >= *due));
}

void ParticipantWatch::look(Surroundings& around, sync::Time now) {
  look_time_ = now;
  looked_at_version_ = around.members_version();
  Neighbourhood neighbourhood = around.find_neighbours();
  neighbourhood.now = now;
  neighbourhood.is_on_network = !around.stays_on_this_machine();
  neighbourhood.is_flying = report_.phase() == RunPhase::PHASE_RUNNING;
  neighbourhood.stamps_ahead_s = stamps_.take();
  report_.problem = around.replace_problems(check_.look(neighbourhood));
  problems_version_ = around.problems_version();
}

void ParticipantWatch::report_silent_recorder(sync::Time now) {
  if (report_.phase() != RunPhase::PHASE_RUNNING) return;
  if (recorder_report_time_ && now - *recorder_report_time_ < kReportInterval) return;
  const std::string silent = name_silent_recorder(roster_, fleet_.step(), now - kRecorderSilence);
  if (silent.empty()) return;
  recorder_report_time_ = now;
  report_.announce(fmt::format("step {}: {}", fleet_.step(), silent), now);
}

std::string ParticipantWatch::name_awaited_controller(const Vehicle& vehicle) const {
  const auto client = vehicle.gate.awaited_client();
  if (!client && vehicle.last_client().empty()) return "controller (none is ready)";
  if (!client) return fmt::format("controller '{}' (gone)", vehicle.last_client());
  std::string name =
      fmt::format("controller '{}'{}", client->name, describe_place(roster_, client->peer));
  if (!client->is_gone && report_.problem.empty())
    name += check_.answers().describe_rejections(client->peer);
  return name;
}

std::string ParticipantWatch::name_awaited_controllers() const {
  std::map<std::string, std::vector<std::uint32_t>> awaited;
  for (const auto& vehicle : fleet_.vehicles())
    if (!vehicle->gate.accepted())
      awaited[name_awaited_controller(*vehicle)].push_back(vehicle->id());
  std::string names;
  for (const auto& [name, ids] : awaited)
    names += (names.empty() ? "" : ", ") + name + fleet_.describe(ids);
  return names;
}

}  // namespace sls::sim
