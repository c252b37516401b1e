#include "sim_server/core/leaving.hpp"

#include <spdlog/fmt/fmt.h>

namespace sls::sim {
namespace {

/// " 'disk' on box, 'other' on hub (gone)": the recorders that are not done.
std::string name_missing(const std::vector<sync::Member>& recorders, sync::Time now) {
  std::string names;
  for (const sync::Member& member : recorders)
    if (!member.announcement.done())
      names += fmt::format("{} '{}' on {}{}", names.empty() ? "" : ",",
                           member.announcement.name().c_str(), member.announcement.host().c_str(),
                           member.is_silent(now) ? " (gone)" : "");
  return names.empty() ? " (gone)" : names;
}

}  // namespace

bool Leaving::look(const Around& around, sync::Time now) {
  if (!recorders_done_ && are_recorders_done(around, now)) recorders_done_ = now;
  return recorders_done_ && (around.is_acknowledged || now >= *recorders_done_ + kAcknowledgement);
}

bool Leaving::are_recorders_done(const Around& around, sync::Time now) {
  const bool is_expected_missing = around.done < expected_;
  if (sync::are_recorders_done(around.recorders, now) && !is_expected_missing) return true;
  if (get_further(around.recorders) && !around.is_stopped) wait_.renew(now);
  if (wait_.is_over(now) || longest_.is_over(now)) {
    const std::string text = "the recording is not complete: gave up waiting for recorder" +
                             name_missing(around.recorders, now);
    if (is_expected_missing && is_failure_)
      error_ = text;
    else
      lines_.push_back({true, text});
    return true;
  }
  if (wait_.is_report_due(now))
    lines_.push_back(
        {false, fmt::format("waiting for: recorder{} to finish ({:.0f} s left)",
                            name_missing(around.recorders, now), wait_.seconds_left(now))});
  return false;
}

/// True if one of `recorders` has completed steps since the last call.
bool Leaving::get_further(const std::vector<sync::Member>& recorders) {
  bool is_any_further = false;
  for (const sync::Member& member : recorders) {
    const std::int64_t step = member.announcement.last_complete_step();
    std::int64_t& last = last_steps_.try_emplace(member.peer, step).first->second;
    is_any_further = step > std::exchange(last, step) || is_any_further;
  }
  return is_any_further;
}

}  // namespace sls::sim
