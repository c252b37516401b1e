#include "sim_server/core/participants/roster.hpp"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <limits>

#include "common/config/vehicle_ids.hpp"

namespace sls::sim {
namespace {

using Entry = sync::Member;

std::string describe(const Entry& entry) {
  return fmt::format("'{}' on {}", entry.announcement.name().c_str(),
                     entry.announcement.host().c_str());
}

std::string describe_gone(const Entry& entry) {
  return fmt::format("'{}' (gone)", entry.announcement.name().c_str());
}

/// "controller", "2 controllers (1 ready; 'client' on host: not ready)" …
std::string name_missing_role(const char* role, int expected, int ready,
                              const std::string& details) {
  std::string text = role;
  if (expected != 1) text = fmt::format("{} {}s ({} ready)", expected, role, ready);
  if (!details.empty()) text += " [" + details + "]";
  return text;
}

/// The recorders that were ready when the flight began. The most advanced of the others replace
/// those that are gone.
std::vector<const Entry*> find_recorders_to_wait_for(const Roster& roster, int expected) {
  std::vector<const Entry*> found, late;
  for (const Entry& entry : roster.recorders) {
    if (!entry.announcement.ready() || entry.is_silent(roster.now)) continue;
    const bool is_late = roster.began && entry.ready_since > *roster.began;
    (is_late ? late : found).push_back(&entry);
  }
  std::sort(late.begin(), late.end(), [](const Entry* a, const Entry* b) {
    return a->announcement.last_complete_step() > b->announcement.last_complete_step();
  });
  for (const Entry* entry : late)
    if (static_cast<int>(found.size()) < expected) found.push_back(entry);
  return found;
}

/// The first step that the recorder does not have completely; valid for any announced number.
std::int64_t find_next_step(const Entry& recorder) {
  constexpr std::int64_t kLargest = std::numeric_limits<std::int64_t>::max();
  return std::clamp<std::int64_t>(recorder.announcement.last_complete_step(), -1, kLargest - 1) + 1;
}

/// The first step that must wait for a recorder that has all steps before `next`.
std::int64_t find_limit(std::int64_t next, std::int64_t window) {
  return next + std::min(window, std::numeric_limits<std::int64_t>::max() - next);
}

void append(std::string& list, const std::string& item) {
  if (!list.empty()) list += ", ";
  list += item;
}

}  // namespace

std::vector<ReadyClient> find_ready_clients(const Roster& roster,
                                            const std::string& scenario_sha256,
                                            std::uint32_t vehicle_id) {
  std::vector<ReadyClient> clients;
  for (const Entry& entry : roster.controllers)
    if (entry.announcement.ready() && entry.announcement.scenario_sha256() == scenario_sha256 &&
        sync::flies_vehicle(entry.announcement, vehicle_id))
      clients.push_back({entry.peer, entry.announcement.name().to_string(),
                         entry.announcement.strength(), entry.is_gone});
  return clients;
}

std::string name_missing(const Roster& roster, const config::WaitFor& expected,
                         const std::string& scenario_sha256,
                         const std::vector<std::uint32_t>& vehicle_ids) {
  std::string missing;
  int controllers = std::numeric_limits<int>::max();  // of the vehicle that has the fewest
  std::vector<std::uint32_t> without;
  for (const std::uint32_t id : vehicle_ids) {
    const auto clients = find_ready_clients(roster, scenario_sha256, id);
    const auto ready = static_cast<int>(std::count_if(
        clients.begin(), clients.end(), [](const ReadyClient& client) { return !client.is_gone; }));
    controllers = std::min(controllers, ready);
    if (ready < expected.controllers) without.push_back(id);
  }
  if (!without.empty()) {
    std::string details;
    for (const Entry& entry : roster.controllers) {
      if (entry.is_gone)
        append(details, describe_gone(entry));
      else if (!(entry.announcement.scenario_sha256() == scenario_sha256))
        append(details, describe(entry) + " has another scenario");
      else if (!entry.announcement.ready())
        append(details, describe(entry) + " is not ready");
    }
    if (vehicle_ids.size() > 1)
      append(details, "vehicles without: " + config::to_vehicle_ranges(without));
    append(missing, name_missing_role("controller", expected.controllers, controllers, details));
  }
  int recorders = 0;
  std::string details;
  for (const Entry& entry : roster.recorders) {
    if (entry.is_silent(roster.now))
      append(details, describe_gone(entry));
    else if (entry.announcement.ready())
      ++recorders;
    else
      append(details, describe(entry) + " is not ready");
  }
  if (recorders < expected.recorders)
    append(missing, name_missing_role("recorder", expected.recorders, recorders, details));
  return missing;
}

std::int64_t calc_recorder_window(std::uint64_t history_steps) {
  const std::uint64_t steps = std::min<std::uint64_t>(history_steps * 2 / 5, kRecorderWindow);
  return std::max<std::int64_t>(static_cast<std::int64_t>(steps), 1);
}

std::uint64_t calc_recorder_limit(const Roster& roster, int expected, std::int64_t window) {
  const auto waited_for = find_recorders_to_wait_for(roster, expected);
  if (static_cast<int>(waited_for.size()) < expected) return 0;
  std::int64_t limit = std::numeric_limits<std::int64_t>::max();
  for (const Entry* entry : waited_for)
    limit = std::min(limit, find_limit(find_next_step(*entry), window));
  return static_cast<std::uint64_t>(limit);
}

std::string name_blocking_recorder(const Roster& roster, int expected, std::uint64_t step,
                                   std::int64_t window) {
  const auto waited_for = find_recorders_to_wait_for(roster, expected);
  for (const Entry* entry : waited_for) {
    if (static_cast<std::int64_t>(step) >= find_limit(find_next_step(*entry), window))
      return fmt::format("recorder {}: {} steps behind", describe(*entry),
                         static_cast<std::int64_t>(step) - find_next_step(*entry));
  }
  const int there = static_cast<int>(waited_for.size());
  return there < expected ? fmt::format("recorder: {} expected, {} there", expected, there)
                          : std::string();
}

std::string name_silent_recorder(const Roster& roster, std::uint64_t step,
                                 std::chrono::steady_clock::time_point since) {
  const bool is_any_alive =
      std::any_of(roster.recorders.begin(), roster.recorders.end(), [&](const Entry& entry) {
        return entry.announcement.ready() && !entry.is_silent(roster.now);
      });
  for (const Entry& entry : roster.recorders) {
    const bool lags = entry.announcement.last_complete_step() + 1 < static_cast<std::int64_t>(step);
    const bool is_replaced = entry.is_silent(roster.now) && is_any_alive;
    if (entry.announcement.ready() && lags && entry.heard < since && !is_replaced)
      return fmt::format("recorder {} is silent since step {}", describe(entry),
                         entry.announcement.last_complete_step());
  }
  return "";
}

std::string describe_place(const Roster& roster, const bus::PeerId& peer) {
  for (const Entry& entry : roster.controllers) {
    if (!(entry.peer == peer)) continue;
    if (entry.is_gone) return " (gone)";
    return " on " + entry.announcement.host().to_string();
  }
  return " on ?";
}

}  // namespace sls::sim
