/// A run as it comes over the wire, made up: every number is distinct, the physics is not.
#pragma once

#include <cstdint>
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

/// State of `step`; the force in it is that of the pilot's answer to the step before.
VehicleState make_state(std::uint64_t step);
ControlCommand make_command(std::uint64_t step);
Reference make_reference(std::uint64_t step);

/// State of `step` where nobody's answer to the step before was in force but `origin`: the force
/// answered earlier and the force applied are two others.
VehicleState make_unanswered_state(std::uint64_t step, ForceOrigin origin);

/// What another client answered to `step`: another force, another reference.
ControlCommand make_standby_command(std::uint64_t step);
Reference make_standby_reference(std::uint64_t step);

SimStatus make_status(RunPhase phase, std::uint64_t step, const std::string& reason = "");

}  // namespace sls::record::test
