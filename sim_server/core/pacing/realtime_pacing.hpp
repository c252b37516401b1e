#pragma once

#include <chrono>
#include <cstdint>
#include <optional>

#include "sim_server/core/pacing/client_clocks.hpp"
#include "sim_server/core/pacing/pacing.hpp"
#include "sim_server/core/pacing/schedule.hpp"
#include "sim_server/core/run_parts.hpp"

namespace sls::sim {

/// The server advances on the monotonic clock. A period is flown with the answer to the state at
/// its beginning if the answer came before its end. Otherwise the newest valid answer is held
/// (zero-order hold); after `max_hold_s` the fail-safe force acts. A run without late answers is
/// the same, bit for bit, as in lockstep.
class RealtimePacing : public Pacing {
 public:
  explicit RealtimePacing(RunParts& run);

  void begin(sync::Time now) override;
  sync::Time due() const override { return schedule_.due(run_.fleet.step()); }
  void published(const Moment& moment) override;
  /// The step is over when every vehicle has its answer, so the period can be integrated before its
  /// end and the next state is ready when it is due, or when its time is over.
  bool close(sync::Time now) override;
  sync::Time deadline() const override { return close_at_; }

  void received(const CommandSample& sample) override;
  void note_late(Vehicle& vehicle, const OfferedAnswer& answer, sync::Time now) override;
  void roster_changed(sync::Time now) override;
  void look(const Surroundings& around) override;
  void note_rest(sync::Duration rest) override;

 private:
  /// True when the mission is over for every vehicle, also by an answer that came late.
  bool is_ending() const;
  /// After late answers have ended the mission, waits for the answers to the last step; true if the
  /// wait is to go on.
  bool wait_for_last_answers(sync::Time now);
  void ignore_lifespan_if_needed();
  void pass_over_silent_clients(sync::Time now);
  void fly_without_answers(sync::Time now);
  void show_progress(sync::Time now);

  RunParts& run_;
  Schedule schedule_;
  sync::Time published_{};  // the state in work
  sync::Time close_at_{};
  int last_attempts_ = 0;                          // to get the answers to the last step
  sync::Duration stopped_{0};                      // of the program until the last state
  std::optional<std::uint64_t> missed_deadlines_;  // count of the middleware at the last look
  std::optional<std::chrono::nanoseconds> lifespan_;
  ClientClocks clocks_;
  SlowAnswers slow_answers_;
  bool is_lifespan_ignored_ = false;
  sync::Time next_progress_{};
};

}  // namespace sls::sim
