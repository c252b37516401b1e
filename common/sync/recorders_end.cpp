#include "common/sync/recorders_end.hpp"

#include <spdlog/fmt/fmt.h>

#include <utility>

namespace sls::sync {
namespace {

/// True if one of `recorders` has completed steps since `last_steps`; updates `last_steps`.
bool get_further(const std::vector<Member>& recorders,
                 std::map<bus::PeerId, std::int64_t>& last_steps) {
  bool is_any_further = false;
  for (const Member& member : recorders) {
    const std::int64_t step = member.announcement.last_complete_step();
    std::int64_t& last = last_steps.try_emplace(member.peer, step).first->second;
    is_any_further = step > std::exchange(last, step) || is_any_further;
  }
  return is_any_further;
}

}  // namespace

bool RecordersEnd::is_over(const std::vector<Member>& recorders, int done, bool is_stopped,
                           Time now) {
  if (wait_.is_over(now) || longest_.is_over(now)) return true;
  if (get_further(recorders, last_steps_) && !is_stopped) wait_.renew(now);
  return are_recorders_done(recorders, now) && done >= expected_;
}

std::optional<std::string> RecordersEnd::take_report(const std::vector<Member>& recorders,
                                                     Time now) {
  if (!wait_.is_report_due(now)) return std::nullopt;
  std::string names;
  for (const Member& member : recorders)
    if (!member.announcement.done())
      names += fmt::format(" '{}' on {}", member.announcement.name().c_str(),
                           member.announcement.host().c_str());
  return fmt::format("waiting for: recorder{} to finish ({:.0f} s left)",
                     names.empty() ? " (gone)" : names, wait_.seconds_left(now));
}

}  // namespace sls::sync
