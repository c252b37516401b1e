#pragma once

#include <chrono>
#include <cstdint>
#include <optional>

#include "sim_server/retransmission_timer.hpp"
#include "sim_server/run.hpp"

namespace sls::sim {

/// Stop-and-wait: a state is integrated only with an answer to it, and the answer is the
/// acknowledgement. Without one the state is sent again. Nothing is lost by waiting, so the result
/// depends on no clock, unless `sync.wait.controller` says to fly on.
class LockstepRun : public Run {
 public:
  using Run::Run;

 private:
  std::optional<Outcome> exchange(const VehicleState& state) override;
  bool wait_for_recorders(std::uint64_t step) override;
  void rested(Clock::duration) override {}

  void take_over_if_silent(Clock::time_point now);

  const std::int64_t recorder_window_ =
      calc_recorder_window(endpoints_.state_writer.history_depth());
  RetransmissionTimer timer_;
  Clock::time_point take_over_at_;
};

}  // namespace sls::sim
