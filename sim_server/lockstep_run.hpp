#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <exception>
#include <mutex>

#include "sim_server/retransmission_timer.hpp"
#include "sim_server/run.hpp"

namespace sls::sim {

/// Stop-and-wait: a state is integrated only with an answer to it, and the answer is the
/// acknowledgement. Without one the state is sent again. Nothing is lost by waiting, so the result
/// depends on no clock, unless `sync.wait.controller` says to fly on.
///
/// An answer that leaves nothing to wait for is applied where it arrives, on the middleware's
/// thread, and the next state published there: waking the main thread would make a step a fifth
/// longer. The main thread releases `step_mutex_` only while it waits for answers. The
/// middleware's thread only tries to lock it; if that fails, or for anything but a plain step, it
/// leaves the work to the main thread.
class LockstepRun : public Run {
 public:
  using Run::Run;
  ~LockstepRun() override;

 private:
  void begin() override;
  bool exchange() override;
  bool wait_for_recorders() override;
  void roster_changed() override;

  // On the middleware's thread.
  bool receive(const Commands& sample, const bus::PeerId& sender);
  bool is_plain_step() const;

  void publish();
  void take_answered_step();
  bool is_settled() const;
  bool attend_to_silence(Clock::time_point now);
  void resend(Clock::time_point now);
  void fly_without_answers(Clock::time_point now);
  void take_over_if_silent(Clock::time_point now);
  std::string name_blocking() const;

  RetransmissionTimer timer_;

  std::mutex step_mutex_;  // over what a step touches
  std::unique_lock<std::mutex> main_lock_{step_mutex_, std::defer_lock};
  std::exception_ptr error_;            // of the middleware's thread
  std::uint64_t recorder_limit_ = 0;    // the first step that a recorder is not ready for
  Clock::time_point sent_, last_sent_;  // the states of the step in work, first and last
  Clock::time_point resend_at_;
  std::atomic<Clock::time_point> wake_at_{Clock::time_point()};  // the main thread waits for it
  Clock::time_point take_over_at_;
  Clock::time_point looked_;  // when the main thread last looked for what is late
  bool is_late_ = false;      // most answers come before the first resend
};

}  // namespace sls::sim
