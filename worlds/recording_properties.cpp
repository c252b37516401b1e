/// What must hold of a recording: its rows are those of the run, and its manifest says what is
/// there.
#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <set>
#include <string>

#include "common/bus/names.hpp"
#include "worlds/program.hpp"
#include "worlds/properties.hpp"
#include "worlds/scenarios.hpp"

namespace sls::worlds {
namespace {

/// The outcome of a recording, or the phase of a run, that says how the run ended.
bool is_end(const std::string& outcome) {
  return outcome == "finished" || outcome == "failed" || outcome == "reset";
}

/// `phase`: of the last status that came to be written.
bool may_claim(const std::string& outcome, bool is_closed, const std::string& phase) {
  if (!is_closed) return outcome.empty() || outcome == "recording";
  if (is_end(phase)) return outcome == phase;
  return outcome != "finished" && outcome != "failed" && outcome != "recording";
}

}  // namespace

void Properties::check_recording(const Program& program, const StoredRecording& recording,
                                 const FlownScenario& flown, Promise promise) {
  const auto found = runs_.find(recording.run_id);
  if (found == runs_.end())
    return find(fmt::format("known-run: {} recorded run {:016x}, which no server flew",
                            program.name(), recording.run_id));
  const Run& run = found->second;
  check_rows(program, recording, run);
  if (recording.status) check_claims(program, recording, run);
  for (const std::string& damage : recording.damages)
    find(fmt::format("disk: {}: {}", program.name(), damage));
  if (promise == Promise::kCalm && run.has_ended && recording.claims.outcome == "failed")
    check_whole(program, recording, run);
  if (!recording.claims.complete) return;
  if (!run.is_finished)
    find(fmt::format("complete: {} says so of run {:016x}, which was not finished", program.name(),
                     recording.run_id));
  check_whole(program, recording, run);
  if (!run.has_late && recording.certificate != run.certificate)
    find(fmt::format("complete: {} differs from what {} flew", program.name(), run.server->name()));
  if (run.is_exact && !run.has_mistakes &&
      recording.certificate != flown.certificates.at(run.vehicle_ids))
    find(fmt::format("exact: {} differs from the flight in one process", program.name()));
  if (!recording.claims.timing.empty() && recording.claims.timing != run.timing)
    find(fmt::format("timing-label: {}: expected '{}', got '{}'", program.name(), run.timing,
                     recording.claims.timing));
}

void Properties::check_whole(const Program& program, const StoredRecording& recording,
                             const Run& run) {
  for (const auto& [vehicle, rows] : run.rows) {
    const auto kept = recording.rows.find(vehicle);
    if (kept == recording.rows.end() || kept->second.steps.size() != rows.size())
      find(fmt::format("complete: {} lacks rows of vehicle {}", program.name(), vehicle));
  }
}

/// Each row is that of the run; rows are in order; those that are not there are listed.
void Properties::check_rows(const Program& program, const StoredRecording& recording,
                            const Run& run) {
  // A manifest lists 1,000 gaps and counts the others.
  const bool lists_all = recording.is_closed && recording.claims.missing.further_gaps == 0;
  for (const auto& [vehicle, kept] : recording.rows) {
    const auto flown = run.rows.find(vehicle);
    std::set<std::uint64_t> missing;
    for (const record::MissingSteps& gap : recording.claims.missing.listed)
      if (gap.vehicle_id == vehicle && gap.topic == "sls/state")
        for (std::uint64_t step = gap.from; step <= gap.to; ++step) missing.insert(step);
    std::uint64_t next = 0;
    for (std::size_t i = 0; i < kept.steps.size(); ++i) {
      const std::uint64_t step = kept.steps[i];
      if (step < next) return find(fmt::format("rows: {}: step {} twice", program.name(), step));
      for (; lists_all && next < step; ++next)
        if (missing.count(next) == 0)
          return find(
              fmt::format("rows: {}: step {} of vehicle {} is neither there nor listed as "
                          "missing",
                          program.name(), next, vehicle));
      if (missing.count(step) > 0)
        return find(fmt::format("rows: {}: step {} of vehicle {} is there and listed as missing",
                                program.name(), step, vehicle));
      if (flown == run.rows.end() || step >= flown->second.size() ||
          flown->second[step] != kept.hashes[i])
        return find(fmt::format("rows: {}: step {} of vehicle {} is not that of the run",
                                program.name(), step, vehicle));
      next = step + 1;
    }
    const std::string& outcome = recording.claims.outcome;
    const bool knows_end = is_end(outcome);
    // The last step of a failed run need not be listed: it is not always published.
    const std::uint64_t end = recording.claims.last_step + (outcome == "finished" ? 1 : 0);
    for (; lists_all && knows_end && next < end; ++next)
      if (missing.count(next) == 0 && flown != run.rows.end() && next < flown->second.size())
        return find(
            fmt::format("rows: {}: step {} of vehicle {}, at the end, is neither there nor "
                        "listed as missing",
                        program.name(), next, vehicle));
  }
}

/// What the manifest says is that of what came to be written.
void Properties::check_claims(const Program& program, const StoredRecording& recording,
                              const Run& run) {
  const record::Claims& claims = recording.claims;
  const std::string phase = bus::to_string(recording.status->phase());
  if (!may_claim(claims.outcome, recording.is_closed, phase))
    find(fmt::format("outcome: {} says '{}' {} its end, and the last phase it heard is {}",
                     program.name(), claims.outcome, recording.is_closed ? "after" : "before",
                     phase));
  if (!recording.is_closed || claims.missing.further_gaps > 0) return;
  check_answers(program, recording, run);
  if (is_end(phase) && claims.last_step != recording.status->step())
    find(fmt::format("outcome: {} says that step {} is the last one, the last status says {}",
                     program.name(), claims.last_step, recording.status->step()));
  if (claims.complete && claims.reason != recording.status->reason().to_string())
    find(fmt::format("outcome: {} says '{}', the last status '{}'", program.name(), claims.reason,
                     recording.status->reason().c_str()));
  std::set<std::uint64_t> all = recording.statuses;
  for (const record::MissingSteps& gap : claims.missing.listed)
    if (gap.topic == "sls/status")
      for (std::uint64_t index = gap.from; index <= gap.to; ++index)
        if (!all.insert(index).second)
          return find(fmt::format("rows: {}: status {} is there and listed as missing",
                                  program.name(), index));
  if (all.size() != *all.rbegin() + 1)
    find(fmt::format("rows: {}: of {} statuses {} are there or listed as missing", program.name(),
                     *all.rbegin() + 1, all.size()));
}

/// Each row has the answer with which its step was flown, or that is listed as missing.
void Properties::check_answers(const Program& program, const StoredRecording& recording,
                               const Run& run) {
  const record::Claims& claims = recording.claims;
  std::uint64_t unanswered = 0;
  for (const auto& [vehicle, kept] : recording.rows) {
    const auto is_listed = [&, id = vehicle](const char* topic, std::uint64_t step) {
      const auto& gaps = claims.missing.listed;
      return std::any_of(gaps.begin(), gaps.end(), [&](const record::MissingSteps& gap) {
        return gap.vehicle_id == id && gap.topic == topic && gap.from <= step && step <= gap.to;
      });
    };
    const auto flown = run.answers.find(vehicle);
    const auto late = run.late.find(vehicle);
    for (std::size_t i = 0; i < kept.answers.size(); ++i) {
      const StoredRecording::Answer& answer = kept.answers[i];
      const std::uint64_t step = kept.steps[i];
      unanswered += answer.is_unanswered;
      const bool was_late = late != run.late.end() && late->second.count(step) > 0;
      const bool is_last = i + 1 == kept.answers.size();
      const bool lacks_one = !answer.has_command && !is_last && !is_listed("sls/command", step);
      const bool lacks_other = !answer.has_reference && !answer.is_unanswered && !is_last &&
                               !is_listed("sls/reference", step);
      if (lacks_one || lacks_other)
        find(fmt::format("answers: {} lacks that of step {} of vehicle {}, and does not list it",
                         program.name(), step, vehicle));
      else if (flown == run.answers.end() || flown->second.at(step) != answer.hash)
        find(fmt::format("answers: {} has another than that of step {} of vehicle {}",
                         program.name(), step, vehicle));
      else if (answer.is_unanswered && answer.has_reference != was_late &&
               (answer.has_reference || claims.complete))
        find(fmt::format("answers: {} has {} late answer to step {} of vehicle {}", program.name(),
                         answer.has_reference ? "a" : "no", step, vehicle));
      else
        continue;
      return;
    }
  }
  if (unanswered != claims.unanswered_steps)
    find(fmt::format("answers: {} says that {} steps are without one, and has {}", program.name(),
                     claims.unanswered_steps, unanswered));
}

}  // namespace sls::worlds
