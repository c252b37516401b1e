// Handling of answers, and of missing ones, for both modes.
#include <spdlog/spdlog.h>

#include <algorithm>
#include <map>
#include <utility>

#include "common/app/run_main.hpp"
#include "common/bus/convert.hpp"
#include "common/bus/sync_counters.hpp"
#include "common/config/vehicle_ids.hpp"
#include "sim_server/run.hpp"

namespace sls::sim {
namespace {

using namespace std::chrono_literals;

}  // namespace

SyncCounters Run::sum_counters() const {
  SyncCounters sum = link_;
  for (const auto& vehicle : vehicles_) bus::add(sum, vehicle->gate.counters());
  return sum;
}

/// " (vehicles 0-3)" in a fleet.
std::string Run::describe_vehicles(const std::vector<std::uint32_t>& ids) const {
  if (vehicles_.size() == 1) return "";
  return fmt::format(" (vehicle{} {})", ids.size() > 1 ? "s" : "", config::to_vehicle_ranges(ids));
}

Vehicle* Run::find_vehicle(std::uint32_t id) {
  const auto found = std::lower_bound(vehicle_ids_.begin(), vehicle_ids_.end(), id);
  if (found == vehicle_ids_.end() || *found != id) return nullptr;
  return vehicles_[static_cast<std::size_t>(found - vehicle_ids_.begin())].get();
}

void Run::judge(const Commands& sample, const bus::PeerId& sender, bool is_early) {
  offered_.run_id = sample.run_id();
  offered_.step = sample.step();
  offered_.client_name = sample.client_name().c_str();
  offered_.is_early = is_early;
  if (sample.vehicles().empty() && sample.run_id() == run_id_)
    check_.note_empty(sender, sample.step());
  for (const ControlCommand& command : sample.vehicles()) {
    offered_.vehicle_id = command.vehicle_id();
    bus::fill(offered_.answer, command);
    Vehicle* vehicle = find_vehicle(command.vehicle_id());
    if (!vehicle) vehicle = vehicles_.front().get();  // its gate refuses and counts the answer
    const Verdict verdict = vehicle->gate.offer(offered_, sender);
    if (verdict == Verdict::kLate) {
      record_late(*vehicle, offered_);
      note_late(*vehicle, offered_);
    }
    const char* defect = to_string(verdict);
    if (*defect == '\0') {
      check_.note_taken(offered_, sender, verdict, vehicle->applied().memory, vehicle->state());
      if (verdict == Verdict::kSuperseded)
        check_.note_superseded(sender, vehicle->gate.superseded_by());
    } else {
      check_.note_rejected(offered_, sender, verdict, board_.step);
      spdlog::debug("command for step {} of vehicle {} from '{}' rejected: {}", offered_.step,
                    command.vehicle_id(), offered_.client_name, defect);
    }
  }
}

void Run::record_late(const Vehicle& vehicle, const OfferedAnswer& offered) {
  model::StepRecord record;
  record.vehicle_id = vehicle.id();
  record.step = record.answered_step = offered.step;
  record.kind = model::AnswerKind::kLate;
  record.client_name = offered.client_name;
  record.answer = offered.answer;
  record_.add_step({&record});
}

bool Run::are_all_accepted() const {
  return std::all_of(vehicles_.begin(), vehicles_.end(),
                     [](const auto& vehicle) { return vehicle->gate.accepted().has_value(); });
}

bool Run::is_anybody_absent() const {
  return std::any_of(vehicles_.begin(), vehicles_.end(),
                     [](const auto& vehicle) { return vehicle->absence.is_acting(); });
}

void Run::check_refusals() {
  const double patience_s = std::chrono::duration<double>(sync::kPresumedDeadAfter).count();
  for (const auto& vehicle : vehicles_) {
    const std::string refusals = describe_refusals(*vehicle);
    const auto now = Clock::now();
    vehicle->note_refused(!refusals.empty(), now);
    if (refusals.empty()) continue;
    if (vehicle->gate.refusal()) throw app::RunError(refusals);
    // A client that died stays announced for a while: only its silence shows that it is gone.
    if (vehicle->calc_refused_s(now) >= patience_s) give_up(patience_s, refusals);
  }
}

std::string Run::describe_refusals(const Vehicle& vehicle) const {
  const std::string refusals = vehicle.gate.describe_refusals();
  return vehicles_.size() == 1 || refusals.empty()
             ? refusals
             : fmt::format("vehicle {}: {}", vehicle.id(), refusals);
}

void Run::give_up(double waited_s, const std::string& refusals) const {
  const std::string cause =
      refusals.empty() ? fmt::format("step {}: ", board_.step) : refusals + "; ";
  throw app::RunError(fmt::format("{}waited {} s for {}{}", cause, waited_s,
                                  name_awaited_controllers(), describe_problem()));
}

/// "; " and the mistake of a participant, for the end of a message about missing participants.
std::string Run::describe_problem() const {
  return board_.problem.empty() ? "" : "; " + board_.problem;
}

void Run::take_answers() {
  for (const auto& vehicle : vehicles_)
    if (!vehicle->is_settled() && vehicle->gate.accepted()) vehicle->take_answer();
  if (vehicles_.front()->is_settled())
    board_.controller_name = vehicles_.front()->record().client_name;
  announce_take_overs();
  if (is_anybody_absent()) return;
  if (announced_absence_) {
    const double absence_s =
        std::chrono::duration<double>(Clock::now() - *announced_absence_).count();
    board_.announce(vehicles_.size() == 1
                        ? fmt::format("step {}: controller '{}' answers again after {:.1f} s",
                                      board_.step, vehicles_.front()->last_client(), absence_s)
                        : fmt::format("step {}: all vehicles get answers again after {:.1f} s",
                                      board_.step, absence_s));
  }
  absence_wait_.reset();
  absence_action_.reset();
  announced_absence_.reset();
}

void Run::announce_take_overs() {
  std::map<std::pair<std::string, std::string>, std::vector<std::uint32_t>> switches;
  for (const auto& vehicle : vehicles_)
    if (const auto& switched = vehicle->gate.take_over())
      switches[{switched->from, switched->to}].push_back(vehicle->id());
  for (const auto& [names, ids] : switches)
    board_.announce(fmt::format("step {}: controller '{}' takes over from '{}'{}", board_.step,
                                names.second, names.first, describe_vehicles(ids)));
}

double Run::calc_longest_absence_s() const {
  double longest = 0.0;
  const auto now = Clock::now();
  for (const auto& vehicle : vehicles_) longest = std::max(longest, vehicle->calc_absence_s(now));
  return longest;
}

std::string Run::name_awaited_controllers() const {
  std::map<std::string, std::vector<std::uint32_t>> awaited;
  for (const auto& vehicle : vehicles_) {
    if (vehicle->gate.accepted()) continue;
    const auto client = vehicle->gate.awaited_client();
    const std::string& last = vehicle->last_client();
    const bool is_there = client && !client->is_gone && board_.problem.empty();
    awaited[client         ? fmt::format("controller '{}'{}{}", client->name,
                                         describe_place(roster_, client->peer),
                                 is_there ? check_.describe_rejections(client->peer) : "")
            : last.empty() ? std::string("controller (none is ready)")
                           : fmt::format("controller '{}' (gone)", last)]
        .push_back(vehicle->id());
  }
  std::string names;
  for (const auto& [name, ids] : awaited)
    names += (names.empty() ? "" : ", ") + name + describe_vehicles(ids);
  return names;
}

void Run::attend_to_absence(ControllerAbsence::Action action) {
  using Action = ControllerAbsence::Action;
  const double give_up_s = vehicles_.front()->absence.give_up_s();
  const double absence_s = calc_longest_absence_s();
  if (action == Action::kGiveUp) {
    std::string refusals;
    for (const auto& vehicle : vehicles_)
      if (refusals.empty()) refusals = describe_refusals(*vehicle);
    give_up(give_up_s, refusals);
  }
  if (!absence_wait_)
    absence_wait_.emplace(
        give_up_s - absence_s,
        std::max(Clock::duration(0s), std::chrono::duration_cast<Clock::duration>(
                                          1s - std::chrono::duration<double>(absence_s))));
  const bool is_lockstep = scenario_.sync.mode == config::SyncMode::kLockstep;
  // In real time held steps are counted, not announced: a few of them are normal.
  const bool is_news = action != absence_action_ &&
                       (action == Action::kFailSafe || (action == Action::kHold && is_lockstep));
  const bool is_report_due = absence_wait_->is_report_due();
  if (!announced_absence_ && (is_news || is_report_due))
    announced_absence_ = Clock::now() - std::chrono::duration_cast<Clock::duration>(
                                            std::chrono::duration<double>(absence_s));
  if (is_news) {
    absence_action_ = action;
    board_.announce(
        fmt::format("step {}: no answer from {}; {} force", board_.step, name_awaited_controllers(),
                    action == Action::kHold ? "holding the last" : "applying the fail-safe"));
  }
  if (!is_report_due) return;
  board_.announce(fmt::format("step {}: waiting for: {} ({:.0f} s left){}", board_.step,
                              name_awaited_controllers(), absence_wait_->seconds_left(),
                              describe_problem()));
}

}  // namespace sls::sim
