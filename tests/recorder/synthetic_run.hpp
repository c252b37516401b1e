/// The messages of a made-up run: every number is distinct, but the motion is not physical.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "common/bus/topics.hpp"

namespace sls::record::test {

inline constexpr std::uint64_t kRunId = 0x0123456789abcdef;
inline constexpr std::uint64_t kLastStep = 300;
inline constexpr const char* kPilot = "pilot";

/// Scenario text with a 0.4 s hold, then two laps of 0.4 s of a figure eight; period 4 ms.
extern const char* const kScenarioText;

/// Begins a run: its status samples count from 0.
Parameters make_parameters();
void set_vehicles(Parameters& parameters, const std::vector<std::uint32_t>& ids);
/// Parameters of a plant with attitude and two signals.
Parameters make_signal_parameters();

/// Step `step`, answered by `kPilot`.
RecordEntry make_entry(std::uint64_t step, std::uint32_t vehicle_id = 0);

/// Step `step` with another force than the answer of `kPilot`.
RecordEntry make_unanswered_entry(std::uint64_t step, AnswerKind kind);
/// The late answer of `kPilot` to step `step`.
RecordEntry make_late_entry(std::uint64_t step, std::uint32_t vehicle_id = 0);

/// The last step of a run that failed or was reset: it has no answer.
RecordEntry make_bare_entry(std::uint64_t step);

RecordBatch make_batch(std::uint64_t batch_index, const std::vector<RecordEntry>& entries,
                       bool is_last = false);

SimStatus make_status(RunPhase phase, std::uint64_t step, const std::string& reason = "");

}  // namespace sls::record::test
