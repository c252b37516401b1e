/// The wire's enumerations as words, for messages and files. A value that only a newer version has
/// becomes "unknown".
#pragma once

#include "common/bus/topics.hpp"

namespace sls::bus {

inline const char* to_string(RunPhase phase) {
  switch (phase) {
    case PHASE_WAITING:
      return "waiting";
    case PHASE_RUNNING:
      return "running";
    case PHASE_PAUSED:
      return "paused";
    case PHASE_FINISHED:
      return "finished";
    case PHASE_FAILED:
      return "failed";
    case PHASE_RESET:
      return "reset";
  }
  return "unknown";
}

inline const char* to_string(FaultCode fault) {
  switch (fault) {
    case FAULT_NONE:
      return "none";
    case FAULT_FREE_FALL:
      return "free_fall";
    case FAULT_ROD_LEVEL:
      return "rod_level";
    case FAULT_NOT_FINITE:
      return "not_finite";
    case FAULT_STAGE_TIMEOUT:
      return "stage_timeout";
  }
  return "unknown";
}

inline const char* to_string(SyncMode mode) {
  switch (mode) {
    case MODE_LOCKSTEP:
      return "lockstep";
    case MODE_REALTIME:
      return "realtime";
  }
  return "unknown";
}

inline const char* to_string(ParticipantRole role) {
  switch (role) {
    case ROLE_CONTROLLER:
      return "controller";
    case ROLE_RECORDER:
      return "recorder";
  }
  return "unknown";
}

}  // namespace sls::bus
