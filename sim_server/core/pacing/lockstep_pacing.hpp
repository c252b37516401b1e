#pragma once

#include "sim_server/core/pacing/pacing.hpp"
#include "sim_server/core/pacing/retransmission_timer.hpp"
#include "sim_server/core/run_parts.hpp"

namespace sls::sim {

/// Stop-and-wait: the server integrates a state only with an answer to it. The answer is also the
/// acknowledgement: without one the server sends the state again. The result depends on no clock,
/// unless `sync.wait.controller` allows steps without an answer. Rules: docs/synchronisation.md.
class LockstepPacing : public Pacing {
 public:
  explicit LockstepPacing(RunParts& run) : run_(run) {}

  void begin(sync::Time) override {}
  sync::Time due() const override { return {}; }
  void published(const Moment& moment) override;
  bool close(sync::Time now) override;
  sync::Time deadline() const override { return look_at_; }
  /// Its client is back: the step in work waits for it again, for the whole deadline.
  void note_late(Vehicle& vehicle, const OfferedAnswer& answer, sync::Time) override {
    vehicle.keep_late_answer(answer);
  }

 private:
  void take_answered_step(sync::Time now);
  void attend_to_silence(sync::Time now);
  void resend(sync::Time now);
  void fly_without_answers(sync::Time now);
  void take_over_if_silent(sync::Time now);

  RunParts& run_;
  RetransmissionTimer timer_;
  sync::Time sent_{}, last_sent_{};  // when the step's states were sent, first and last
  sync::Duration paused_{0};         // of the time since then
  sync::Time resend_at_{};
  sync::Time look_at_{};  // next check for missing answers
  sync::Time looked_{};   // the last one
  sync::Time take_over_at_{};
  bool is_late_ = false;  // true after the first check of the step in work
};

}  // namespace sls::sim
