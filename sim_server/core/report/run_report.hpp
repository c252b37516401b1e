#pragma once

#include <cstdint>
#include <string>

#include "common/config/scenario.hpp"
#include "sim_server/core/outputs.hpp"
#include "sim_server/core/report/status_series.hpp"
#include "sim_server/core/step/fleet.hpp"

namespace sls::sim {

/// The server's reports on a run, in sls/status and in the log.
class RunReport {
 public:
  RunReport(Outputs& outputs, const Fleet& fleet, std::uint64_t run_id, const config::Sync& sync)
      : series(run_id, fleet.ids().front(), sync),
        outputs_(outputs),
        fleet_(fleet),
        period_ns_(sync.period_ns) {}

  /// Publishes a sample.
  void publish(RunPhase phase, const std::string& reason, sync::Time now);
  /// Publishes a sample of the present phase.
  void publish(const std::string& reason, sync::Time now) { publish(phase_, reason, now); }
  /// Reports an event that does not change the phase: in the log and as the reason of a sample.
  void announce(const std::string& event, sync::Time now);

  RunPhase phase() const { return phase_; }
  /// True once a sample of the run was published: participants may have joined.
  bool has_published() const { return series.size() > 0; }

  /// "finished: 2500 steps, 10 s simulated in 0.12 s, …".
  std::string describe_end(sync::Time now) const;
  /// "; " and the mistakes of participants, for the end of a message; empty if there is none.
  std::string describe_problem() const { return problem.empty() ? "" : "; " + problem; }

  // Content of the samples, kept up to date by the parts of the core.
  StatusSeries series;
  std::string problem;  ///< mistakes of participants; empty if there are none
  SyncCounters link;    ///< counts that belong to no single vehicle

 private:
  Outputs& outputs_;
  const Fleet& fleet_;
  const std::int64_t period_ns_;
  RunPhase phase_ = RunPhase::PHASE_WAITING;
};

}  // namespace sls::sim
