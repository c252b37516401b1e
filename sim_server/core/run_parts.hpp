#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <utility>

#include "sim_server/core/outputs.hpp"
#include "sim_server/core/report/absence_report.hpp"
#include "sim_server/core/run_control.hpp"

namespace sls::sim {

/// The parts of a run that core and pacing share.
struct RunParts {
  RunParts(const config::Scenario& scenario_of_run, std::uint64_t run, bool begins_paused,
           std::unique_ptr<Fleet> fleet_of_run, Outputs& shell)
      : scenario(scenario_of_run),
        run_id(run),
        outputs(shell),
        owned_fleet(std::move(fleet_of_run)),
        fleet(*owned_fleet),
        report(outputs, fleet, run_id, scenario.sync),
        watch(scenario, run_id, fleet, report),
        control(run_id, fleet.ids(), begins_paused),
        absence(fleet, watch, report, scenario.sync) {}

  /// Remarks of the plants since the last call become events of this step.
  void announce_remarks(sync::Time now) {
    for (const std::string& remark : fleet.take_remarks()) report.announce(remark, now);
  }

  /// No controller was waited for during `rest`.
  void note_rest(sync::Duration rest) {
    fleet.note_rest(rest);
    absence.note_rest(rest);
  }

  const config::Scenario scenario;
  const std::uint64_t run_id;
  Outputs& outputs;
  const std::unique_ptr<Fleet> owned_fleet;
  Fleet& fleet;
  RunReport report;
  ParticipantWatch watch;
  RunControl control;
  AbsenceReport absence;
};

}  // namespace sls::sim
