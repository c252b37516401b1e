/// A run as it comes over the wire, made up: every number is distinct, the physics is not.
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

/// A run begins with them: its status samples count from 0.
Parameters make_parameters();
void set_vehicles(Parameters& parameters, const std::vector<std::uint32_t>& ids);
/// Those of a plant with attitude, and of two signals.
Parameters make_signal_parameters();

/// Step `step`, answered by the pilot.
RecordEntry make_entry(std::uint64_t step, std::uint32_t vehicle_id = 0);

/// Step `step` that went by with another force than the pilot's.
RecordEntry make_unanswered_entry(std::uint64_t step, AnswerKind kind);
/// The pilot's answer to it, which came late.
RecordEntry make_late_entry(std::uint64_t step, std::uint32_t vehicle_id = 0);

/// The last step of a run that failed or was reset: nobody's answer is in force.
RecordEntry make_bare_entry(std::uint64_t step);

RecordBatch make_batch(std::uint64_t batch_index, const std::vector<RecordEntry>& entries,
                       bool is_last = false);

SimStatus make_status(RunPhase phase, std::uint64_t step, const std::string& reason = "");

}  // namespace sls::record::test
