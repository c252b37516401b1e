#include "sim_server/core/report/run_report.hpp"

#include <spdlog/fmt/fmt.h>

#include "common/bus/sync_counters.hpp"
#include "common/sync/invariant.hpp"
#include "common/sync/servers.hpp"

namespace sls::sim {

void RunReport::publish(RunPhase phase, const std::string& reason, sync::Time now) {
  const int before = has_published() ? sync::calc_progress(phase_) : 0;
  const int after = sync::calc_progress(phase);  // both are negative after the end
  const bool goes_on = before >= 0 && (after < 0 || after >= before);
  const bool is_failed_reset = phase_ == RunPhase::PHASE_RESET && phase == RunPhase::PHASE_FAILED;
  sync::keep(goes_on || is_failed_reset, "a run never goes back to an earlier phase");
  phase_ = phase;
  SyncCounters counters = link;
  for (const auto& vehicle : fleet_.vehicles()) bus::add(counters, vehicle->gate.counters());
  outputs_.send(series.make(
      {phase, reason, fleet_.step(), fleet_.vehicles().front()->flown_by(), problem, counters},
      now));
}

void RunReport::announce(const std::string& event, sync::Time now) {
  outputs_.log({true, event});
  publish(event, now);
}

std::string RunReport::describe_end(sync::Time now) const {
  const double wall_s = series.calc_wall_s(now);
  const auto steps = static_cast<double>(fleet_.step());
  return fmt::format(
      "finished: {} steps, {} s simulated in {:.2f} s, {:.0f} steps/s, {} resent, {}",
      fleet_.step(), steps * static_cast<double>(period_ns_) / 1e9, wall_s, steps / wall_s,
      link.resent(), series.timing.label());
}

}  // namespace sls::sim
