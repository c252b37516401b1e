#pragma once

#include <chrono>

#include "common/bus/peer.hpp"
#include "sim_server/core/outputs.hpp"

namespace sls::sim {

/// Arrival of a sample of sls/command.
struct CommandArrival {
  bus::PeerId sender;
  Moment arrived;
  std::chrono::system_clock::time_point written{};  ///< by the sender's clock
};

}  // namespace sls::sim
