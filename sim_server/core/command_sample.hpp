#pragma once

#include <chrono>
#include <cstdint>
#include <string>
#include <vector>

#include "common/bus/peer.hpp"
#include "sim_server/core/command_gate.hpp"
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

}  // namespace sls::sim
