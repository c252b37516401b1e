#include "common/sync/server_watch.hpp"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <utility>

namespace sls::sync {

ServerWatch::Finding ServerWatch::look(const std::optional<Time>& heard, Time now) {
  constexpr auto kQuietTime = std::chrono::seconds(1);
  report_.reset();
  heard_ = std::max(heard_, heard.value_or(heard_));
  if (now - heard_ < kQuietTime) {
    if (std::exchange(is_reported_, false))
      report_ = Line{false, fmt::format("the server of run {:016x} is back", run_id_)};
    wait_.reset();
    return Finding::kThere;
  }
  if (!wait_) wait_.emplace(now, deadline_s_, Duration::zero());
  if (wait_->is_over(now)) return Finding::kLost;
  if (wait_->is_report_due(now)) {
    report_ = Line{true, fmt::format("waiting for: {} ({:.0f} s left)", describe(now),
                                     wait_->seconds_left(now))};
    is_reported_ = true;
  }
  return Finding::kSilent;
}

std::string ServerWatch::describe(Time now) const {
  return fmt::format("server of run {:016x} (silent for {:.1f} s)", run_id_,
                     to_seconds(now - heard_));
}

}  // namespace sls::sync
