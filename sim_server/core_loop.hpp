#pragma once

#include <atomic>
#include <chrono>
#include <mutex>
#include <utility>

#include "common/app/mailbox.hpp"
#include "sim_server/backlog.hpp"
#include "sim_server/core/server_core.hpp"

namespace sls::sim {

/// Drives the core of a server: the only place with its lock and its waiting.
///
/// In lockstep the core is called on the middleware's thread that delivers an answer; there it also
/// publishes the next state, because waking the main thread would make a step a fifth longer. That
/// thread only tries to lock the core. If it fails, or if other events wait, the sample waits for
/// the main thread. In real time every event goes to the main thread.
///
/// In lockstep each step moves the deadline by which its answer must have come. Waking at each of
/// them, a thousand times a second, cost the main thread 2.5 % of a processor. So it sleeps longer
/// (`calc_slack`): a lost sample is sent again later, but a flight takes at most a 32nd longer.
class CoreLoop {
 public:
  using Clock = std::chrono::steady_clock;

  /// Extra sleep of the main thread after `duration` without a missing answer: a 32nd of it, at
  /// most 10 ms.
  static Clock::duration calc_slack(Clock::duration duration);

  CoreLoop(bool is_lockstep, Surroundings& around, Backlog& backlog)
      : is_lockstep_(is_lockstep), around_(around), backlog_(backlog) {}

  /// Drives `core` to its end, on the main thread.
  void run(ServerCore& core);
  /// Writes all that waits.
  void write_waiting(ServerCore& core);

  /// A request of an operator came, on any thread.
  void put(const SimControl& request) {
    if (requests_.put(request)) commands_.interrupt();
  }
  /// A sample of sls/command came, on any thread. `fill(sample)` fills in all of it.
  template <class Fill>
  void put(const Fill& fill) {
    if (is_lockstep_ && pass_on(fill)) return;
    CommandSample sample;
    fill(sample);
    commands_.put(std::move(sample));
  }

 private:
  template <class Fill>
  bool pass_on(const Fill& fill) {
    if (main_wants_core_ || !commands_.is_empty() || !requests_.is_empty()) return false;
    const std::unique_lock lock(core_mutex_, std::try_to_lock);
    if (!lock || !core_ || !core_->takes_answers_at_once(around_)) return false;
    fill(received_);
    core_->on_commands(received_);
    note_deadline();
    return true;
  }
  void note_deadline();
  bool wait_until_due();
  void deliver_events(ServerCore& core);

  const bool is_lockstep_;
  Surroundings& around_;
  Backlog& backlog_;
  // The events that must wait for the main thread, which waits for commands_. An event that does
  // not fit is dropped: clients and operators repeat theirs if no answer comes.
  app::Mailbox<CommandSample> commands_{kMostWaitingCommands};
  app::Mailbox<SimControl> requests_{64};

  std::mutex core_mutex_;
  ServerCore* core_ = nullptr;  // under the mutex; null while no run flies
  CommandSample received_;      // likewise; a member to avoid allocation
  std::atomic<bool> main_wants_core_{false};
  std::atomic<sync::Time> deadline_{sync::Time()};      // of the core
  std::atomic<sync::Time> sleeps_until_{sync::Time()};  // the main thread, or up to a slack longer
  bool awaits_answers_ = false;                         // as the main thread saw it last
  sync::Time unanswered_;  // when it last saw a deadline pass without an answer
};

}  // namespace sls::sim
