#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "common/bus/peer.hpp"
#include "sim_server/core/answers/command_gate.hpp"
#include "sim_server/core/outputs.hpp"

namespace sls::sim {

/// A sample of sls/command, and its sender.
struct CommandSample {
  bus::PeerId sender;
  Moment arrived;
  std::chrono::system_clock::time_point written{};  ///< by the sender's clock
  std::uint64_t run_id = 0;
  std::uint64_t step = 0;
  std::string client_name;
  std::vector<OfferedAnswer> answers;
};

/// Samples that wait for the core at most, so that a flood of them fills no memory.
inline constexpr std::size_t kMostWaitingCommands = 4096;

}  // namespace sls::sim
