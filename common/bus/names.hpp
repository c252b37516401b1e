/// The wire's enumerations as words, for messages and files. A value that only a newer version has
/// becomes "unknown".
#pragma once

#include <cstdint>

#include "common/bus/topics.hpp"

namespace sls::bus {

/// The number of an enumerator on the wire. A sample can hold any number, also one that is not
/// defined; compare it by this function, because the enumerations of Fast DDS 3 have a sign.
template <class Enumeration>
constexpr std::uint32_t to_number(Enumeration value) {
  return static_cast<std::uint32_t>(value);
}

inline const char* to_string(RunPhase phase) {
  switch (phase) {
    case RunPhase::PHASE_WAITING:
      return "waiting";
    case RunPhase::PHASE_RUNNING:
      return "running";
    case RunPhase::PHASE_PAUSED:
      return "paused";
    case RunPhase::PHASE_FINISHED:
      return "finished";
    case RunPhase::PHASE_FAILED:
      return "failed";
    case RunPhase::PHASE_RESET:
      return "reset";
  }
  return "unknown";
}

inline const char* to_string(SyncMode mode) {
  switch (mode) {
    case SyncMode::MODE_LOCKSTEP:
      return "lockstep";
    case SyncMode::MODE_REALTIME:
      return "realtime";
  }
  return "unknown";
}

inline const char* to_string(ParticipantRole role) {
  switch (role) {
    case ParticipantRole::ROLE_CONTROLLER:
      return "controller";
    case ParticipantRole::ROLE_RECORDER:
      return "recorder";
  }
  return "unknown";
}

}  // namespace sls::bus
