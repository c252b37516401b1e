/// How fast two processes can take turns when nothing but the turn passes between them: the bound
/// of every loop of two processes. README.md.
#pragma once

#include <cstdint>
#include <ctime>
#include <nlohmann/json_fwd.hpp>

namespace sls::bench {

struct HandOverOptions {
  std::uint64_t rounds = 20000;  ///< measured
  std::uint64_t warm_up = 1000;  ///< before, not measured
  double work_us = 0.0;          ///< of this process in each round, by the clock
  bool may_spin = false;         ///< up to 50 µs before a wait blocks
};

/// The other process, which hands every turn back at once, and the memory that they share.
class HandOver {
 public:
  /// Starts the other process on the processors that this thread may use now.
  explicit HandOver(const HandOverOptions& options);
  ~HandOver();
  HandOver(const HandOver&) = delete;
  HandOver& operator=(const HandOver&) = delete;

  /// Returns `mean_us`, the time of a round with the work in it.
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
