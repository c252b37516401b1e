/// Measures how fast two processes can exchange the loop's samples over Fast DDS without other
/// work: the middleware's part of the bound of `./sls bench`. README.md.
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
  bool may_spin = false;              ///< at both ends; has an effect only with sls::shared_locks
};

/// Sends states and receives commands: each state is sent after the answer to the previous one.
/// Both ends work on the middleware's thread. The other end is a separate process, which runs
/// `answer`. Returns the round trips as Latencies::to_json does, and `lost`, the number of times
/// that the states of a step were sent again.
/// @throws app::RunError if no process answers.
nlohmann::json ping(const PingPongOptions& options);

/// Answers states until a stop signal.
void answer(const PingPongOptions& options);

}  // namespace sls::bench
