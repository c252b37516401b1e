#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <exception>
#include <mutex>

#include "sim_server/core/retransmission_timer.hpp"
#include "sim_server/run.hpp"

namespace sls::sim {

/// Stop-and-wait: the server integrates a state only with an answer to it. The answer is also the
/// acknowledgement: without one the server sends the state again. The result depends on no clock,
/// unless `sync.wait.controller` allows steps without an answer.
///
/// The last missing answer is applied on the middleware's thread that delivers it. This thread also
/// publishes the next state, because waking the main thread would make a step a fifth longer. The
/// main thread releases `step_mutex_` only while it waits for answers. The middleware's thread only
/// tries to lock it. If that fails, or if the step is not a plain one, it leaves the work to the
/// main thread.
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
  /// Names the recorder that prevents the next step; empty if there is none.
  std::string name_blocking() const;
  /// The same for the queue of entries that the record stream has not written.
  std::string name_full_queue() const;
  /// Waits while `name_cause` names a cause, by the policy `sync.wait.recorder`; false if the
  /// operator ended the run. `is_given_up`: the policy `go_on` ended the wait; true until the cause
  /// is gone.
  bool wait_while(std::string (LockstepRun::*name_cause)() const, bool& is_given_up);

  RetransmissionTimer timer_;

  std::mutex step_mutex_;  // protects the data of a step
  std::unique_lock<std::mutex> main_lock_{step_mutex_, std::defer_lock};
  std::exception_ptr error_;            // from the middleware's thread
  std::uint64_t recorder_limit_ = 0;    // the first step that a recorder is not ready for
  Clock::time_point sent_, last_sent_;  // when the step's states were sent, first and last
  Clock::time_point resend_at_;
  std::atomic<Clock::time_point> wake_at_{Clock::time_point()};  // the main thread waits until then
  Clock::time_point take_over_at_;
  Clock::time_point looked_;        // last check for missing answers
  bool is_queue_given_up_ = false;  // policy go_on
  bool is_late_ = false;            // true after the first check of the step in work
};

}  // namespace sls::sim
