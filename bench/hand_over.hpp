/// Measures how fast two processes can take turns without exchanging data: the bound of every loop
/// of two processes. README.md.
#pragma once

#include <cstdint>
#include <ctime>
#include <nlohmann/json_fwd.hpp>

namespace sls::bench {

struct HandOverOptions {
  std::uint64_t rounds = 20000;  ///< measured
  std::uint64_t warm_up = 1000;  ///< before, not measured
  double work_us = 0.0;          ///< wall time of this process's work in each round
  bool may_spin = false;         ///< a wait spins for up to 50 µs before it blocks
};

/// The other process, which gives every turn back at once, and the shared memory.
class HandOver {
 public:
  /// Starts the other process on the processors that this thread may use now.
  explicit HandOver(const HandOverOptions& options);
  ~HandOver();
  HandOver(const HandOver&) = delete;
  HandOver& operator=(const HandOver&) = delete;

  /// Returns `mean_us`, the mean time of a round, including the work.
  nlohmann::json measure();

 private:
  struct Turns;
  void take_turns(std::uint64_t rounds);

  const HandOverOptions options_;
  timespec deadline_{};
  Turns* turns_;
  int other_ = -1;
};

}  // namespace sls::bench
