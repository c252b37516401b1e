/// Participants of a run: those that step 0 or a step waits for, and their names in messages.
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "common/bus/participants.hpp"
#include "common/config/scenario.hpp"
#include "sim_server/command_gate.hpp"

namespace sls::sim {

/// The participants of one run at one moment.
struct Roster {
  std::vector<bus::ParticipantDirectory::Entry> controllers;
  std::vector<bus::ParticipantDirectory::Entry> recorders;
  /// When the flight began; nothing before.
  std::optional<std::chrono::steady_clock::time_point> began = std::nullopt;
};

/// Controllers that are ready to fly `vehicle_id` and use the run's scenario, as its command gate
/// wants them.
std::vector<ReadyClient> find_ready_clients(const Roster& roster,
                                            const std::string& scenario_sha256,
                                            std::uint32_t vehicle_id = 0);

/// Whom the start still waits for, in words; empty when all expected are ready: as many controllers
/// for each of the vehicles.
std::string name_missing(const Roster& roster, const config::WaitFor& expected,
                         const std::string& scenario_sha256,
                         const std::vector<std::uint32_t>& vehicle_ids = {0});

/// How far the slowest recorder may be behind the server, in steps, at most.
inline constexpr std::int64_t kRecorderWindow = 2000;

/// The same where the batches of `history_steps` steps are kept for late recorders: two fifths of
/// them, so that nothing a recorder needs is overwritten.
std::int64_t calc_recorder_window(std::uint64_t history_steps);

/// Which recorder keeps the server from publishing `step`, in words; empty when none does: fewer
/// than `expected` are there and not silent, or one of these is `window` steps behind. One that
/// was not ready when the flight began is waited for only in the place of one that was: a stranger
/// must not stop the others.
std::string name_blocking_recorder(const Roster& roster, int expected, std::uint64_t step,
                                   std::int64_t window = kRecorderWindow);

/// The first step that some recorder keeps the server from publishing; 0 if fewer than
/// `expected` are there.
std::uint64_t calc_recorder_limit(const Roster& roster, int expected,
                                  std::int64_t window = kRecorderWindow);

/// Which ready recorder has announced nothing since `since` although it lags behind `step`, in
/// words; empty when none has, or another one is there in the place of one presumed dead.
std::string name_silent_recorder(const Roster& roster, std::uint64_t step,
                                 std::chrono::steady_clock::time_point since);

/// The host of the controller `peer`; "?" where it is not in the roster.
std::string find_host(const Roster& roster, const bus::PeerId& peer);

}  // namespace sls::sim
