/// Samples, names and times for the tests of common/sync. Times are ms after an arbitrary moment.
#pragma once

#include <chrono>
#include <cstdint>
#include <string>
#include <vector>

#include "common/bus/peer.hpp"
#include "common/sync/time.hpp"
#include "sls.h"

namespace sls::sync {

using namespace std::chrono_literals;

constexpr std::uint64_t kRun = 500, kLowerRun = 400;
constexpr std::uint32_t kVehicle = 4;

constexpr bus::PeerId peer(std::uint8_t number) { return {{number}}; }
constexpr Time at(std::int64_t ms) { return Time(1000h) + std::chrono::milliseconds(ms); }

inline Participant announcement(ParticipantRole role, std::uint64_t run_id,
                                std::int64_t last_complete_step = -1) {
  Participant sample;
  sample.role(role);
  sample.run_id(run_id);
  sample.name("pilot");
  sample.host("here");
  sample.last_complete_step(last_complete_step);
  return sample;
}
inline Participant controller(std::uint64_t run_id = kRun) {
  return announcement(ParticipantRole::ROLE_CONTROLLER, run_id);
}
inline Participant recorder(std::int64_t last_complete_step, bool is_done = false) {
  Participant sample = announcement(ParticipantRole::ROLE_RECORDER, kRun, last_complete_step);
  sample.done(is_done);
  return sample;
}

inline SimStatus status(std::uint64_t run_id, RunPhase phase) {
  SimStatus sample;
  sample.run_id(run_id);
  sample.phase(phase);
  return sample;
}

inline Parameters claim(std::uint64_t run_id, const std::vector<std::uint32_t>& vehicle_ids) {
  Parameters sample;
  sample.run_id(run_id);
  for (const std::uint32_t id : vehicle_ids) sample.vehicles().emplace_back().vehicle_id(id);
  return sample;
}

}  // namespace sls::sync
