/// Participants of a run: those that step 0 or a step waits for, and their names in messages.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "common/config/scenario.hpp"
#include "common/sync/membership.hpp"
#include "sim_server/core/answers/command_gate.hpp"

namespace sls::sim {

/// The participants of one run at one moment.
struct Roster {
  std::vector<sync::Member> controllers;
  std::vector<sync::Member> recorders;
  /// When the flight began; nothing before.
  std::optional<sync::Time> began = std::nullopt;
  sync::Time now{};  ///< this moment
};

/// Controllers that are ready to fly `vehicle_id` and use the run's scenario, for its command gate;
/// also those that are gone, because they may come back with an answer.
std::vector<ReadyClient> find_ready_clients(const Roster& roster,
                                            const std::string& scenario_sha256,
                                            std::uint32_t vehicle_id = 0);

/// Names the participants that the start still waits for; empty when all expected ones are ready.
/// Participants that are gone do not count.
/// The expected number of controllers holds for each vehicle.
std::string name_missing(const Roster& roster, const config::WaitFor& expected,
                         const std::string& scenario_sha256,
                         const std::vector<std::uint32_t>& vehicle_ids = {0});

/// Largest distance of the slowest recorder behind the server, in steps.
inline constexpr std::int64_t kRecorderWindow = 2000;

/// The same if the writer keeps the batches of `history_steps` steps for late recorders: two fifths
/// of them, at most kRecorderWindow. No batch that a recorder still needs is then overwritten.
std::int64_t calc_recorder_window(std::uint64_t history_steps);

/// Names a recorder that prevents the server from publishing `step`; empty if there is none.
/// Reasons: fewer than `expected` are present and not silent, or one of these is `window` steps
/// behind. A recorder that was not ready when the flight began counts only as the replacement of an
/// earlier one: an unexpected recorder must not stop the run.
std::string name_blocking_recorder(const Roster& roster, int expected, std::uint64_t step,
                                   std::int64_t window = kRecorderWindow);

/// The first step that a recorder prevents the server from publishing; 0 if fewer than `expected`
/// are present.
std::uint64_t calc_recorder_limit(const Roster& roster, int expected,
                                  std::int64_t window = kRecorderWindow);

/// Names a ready recorder that has announced nothing since `since` although it is behind `step`.
/// Empty if there is none, or if another recorder has replaced one that is presumed dead.
std::string name_silent_recorder(const Roster& roster, std::uint64_t step, sync::Time since);

/// The host of the controller `peer` as " on box", or " (gone)"; " on ?" if it is not in the
/// roster.
std::string describe_place(const Roster& roster, const bus::PeerId& peer);

}  // namespace sls::sim
