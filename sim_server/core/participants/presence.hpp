/// The controllers of a run that are gone: silent for sync::kPresumedDeadAfter. No network and no
/// clock here. Rules: docs/synchronisation.md, "Waiting for participants".
#pragma once

#include <chrono>
#include <cstdint>
#include <map>
#include <vector>

#include "common/sync/membership.hpp"

namespace sls::sim {

/// Knowledge of the command gates about one controller.
struct Answering {
  std::uint64_t answers = 0;  ///< received so far, for all its vehicles
  bool is_asked = false;      ///< a published state lacks its answer
};

class Presence {
 public:
  using Clock = std::chrono::steady_clock;

  /// Sets `is_gone` of `controllers`, which are all of the run. Call it several times a second.
  void look(std::vector<sync::Member>& controllers,
            const std::map<bus::PeerId, Answering>& answering, Clock::time_point now);

 private:
  struct Seen {
    Clock::time_point heard;
    std::uint64_t answers = 0;
    bool was_asked = false;
    Clock::duration silence{0};
  };
  std::map<bus::PeerId, Seen> seen_;
  Clock::time_point looked_;
};

}  // namespace sls::sim
