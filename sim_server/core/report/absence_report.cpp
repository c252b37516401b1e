#include "sim_server/core/report/absence_report.hpp"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <chrono>
#include <map>
#include <stdexcept>
#include <utility>
#include <vector>

namespace sls::sim {
namespace {

using namespace std::chrono_literals;

}  // namespace

AbsenceReport::AbsenceReport(const Fleet& fleet, const ParticipantWatch& watch, RunReport& report,
                             const config::Sync& sync)
    : fleet_(fleet),
      watch_(watch),
      report_(report),
      is_lockstep_(sync.mode == config::SyncMode::kLockstep),
      give_up_s_(sync.calc_controller_patience_s()) {}

void AbsenceReport::attend(Action action, sync::Time now) {
  const double absence_s = fleet_.calc_longest_absence_s(now);
  if (action == Action::kGiveUp) {
    std::string refusals;
    for (const auto& vehicle : fleet_.vehicles())
      if (refusals.empty()) refusals = fleet_.describe_refusals(*vehicle);
    give_up(give_up_s_, refusals);
  }
  if (!wait_)
    wait_.emplace(now, give_up_s_ - absence_s,
                  std::max<sync::Duration>(0s, 1s - sync::to_duration(absence_s)));
  // In real time held steps are counted, not announced: a few of them are normal.
  const bool is_news = action != action_ &&
                       (action == Action::kFailSafe || (action == Action::kHold && is_lockstep_));
  const bool is_report_due = wait_->is_report_due(now);
  if (!announced_ && (is_news || is_report_due)) announced_ = now - sync::to_duration(absence_s);
  if (is_news) {
    action_ = action;
    report_.announce(
        fmt::format("step {}: no answer from {}; {} force", fleet_.step(),
                    watch_.name_awaited_controllers(),
                    action == Action::kHold ? "holding the last" : "applying the fail-safe"),
        now);
  }
  if (!is_report_due) return;
  report_.announce(fmt::format("step {}: waiting for: {} ({:.0f} s left){}", fleet_.step(),
                               watch_.name_awaited_controllers(), wait_->seconds_left(now),
                               report_.describe_problem()),
                   now);
}

void AbsenceReport::note_answers(sync::Time now) {
  announce_take_overs(now);
  if (fleet_.is_anybody_absent()) return;
  if (announced_) {
    const double absence_s = sync::to_seconds(now - *announced_);
    const auto& vehicles = fleet_.vehicles();
    report_.announce(vehicles.size() == 1
                         ? fmt::format("step {}: controller '{}' answers again after {:.1f} s",
                                       fleet_.step(), vehicles.front()->last_client(), absence_s)
                         : fmt::format("step {}: all vehicles get answers again after {:.1f} s",
                                       fleet_.step(), absence_s),
                     now);
  }
  wait_.reset();
  action_.reset();
  announced_.reset();
}

void AbsenceReport::announce_take_overs(sync::Time now) {
  std::map<std::pair<std::string, std::string>, std::vector<std::uint32_t>> switches;
  for (const auto& vehicle : fleet_.vehicles())
    if (const auto& switched = vehicle->gate.take_over())
      switches[{switched->from, switched->to}].push_back(vehicle->id());
  for (const auto& [names, ids] : switches)
    report_.announce(fmt::format("step {}: controller '{}' takes over from '{}'{}", fleet_.step(),
                                 names.second, names.first, fleet_.describe(ids)),
                     now);
}

void AbsenceReport::check_refusals(sync::Time now) {
  const double patience_s = sync::to_seconds(sync::kPresumedDeadAfter);
  for (const auto& vehicle : fleet_.vehicles()) {
    const std::string refusals = fleet_.describe_refusals(*vehicle);
    vehicle->note_refused(!refusals.empty(), now);
    if (refusals.empty()) continue;
    if (vehicle->gate.refusal()) throw std::runtime_error(refusals);
    // A client that died stays announced for a while: only its silence shows that it is gone.
    if (vehicle->calc_refused_s(now) >= patience_s) give_up(patience_s, refusals);
  }
}

void AbsenceReport::give_up(double waited_s, const std::string& refusals) const {
  const std::string cause =
      refusals.empty() ? fmt::format("step {}: ", fleet_.step()) : refusals + "; ";
  throw std::runtime_error(fmt::format("{}waited {} s for {}{}", cause, waited_s,
                                       watch_.name_awaited_controllers(),
                                       report_.describe_problem()));
}

void AbsenceReport::note_rest(sync::Duration rest) {
  if (wait_) wait_->extend(rest);
  if (announced_) *announced_ += rest;
}

}  // namespace sls::sim
