/// How fast two processes can exchange the loop's samples over Fast DDS when nothing else is done:
/// the middleware's share of the bound of `./sls bench`. README.md.
#pragma once

#include <cstdint>
#include <filesystem>
#include <nlohmann/json_fwd.hpp>

namespace sls::bench {

struct PingPongOptions {
  std::filesystem::path qos_file;
  int domain = 0;
  std::uint32_t vehicles = 1;         ///< up to 64 in each sample
  std::uint64_t round_trips = 20000;  ///< measured
  std::uint64_t warm_up = 2000;       ///< before, not measured
  bool may_spin = false;              ///< both ends, where sls::shared_locks is linked
};

/// States out, commands back, each state sent when the answer to the one before has come. Both ends
/// work on the middleware's thread. The other end is a process of its own, which runs `answer`.
/// Returns the round trips as Latencies does, and `lost`, the states that had to be sent again.
/// @throws app::RunError if nobody answers.
nlohmann::json ping(const PingPongOptions& options);

/// Answers states until a stop signal.
void answer(const PingPongOptions& options);

}  // namespace sls::bench
