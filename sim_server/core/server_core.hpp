#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "common/config/scenario.hpp"
#include "sim_server/core/leaving.hpp"
#include "sim_server/core/pacing/pacing.hpp"
#include "sim_server/core/participants/preparation.hpp"
#include "sim_server/core/participants/recorder_wait.hpp"
#include "sim_server/core/run_parts.hpp"

namespace sls::sim {

/// Decides all that happens in one run of the server, from the claim on its vehicles to its end. It
/// is driven: a function for each kind of event, with the time, and `next_deadline` says when
/// `on_time` must be called without an event. It reads no clock, has no thread, and never throws:
/// an error ends the run. Rules: docs/synchronisation.md.
///
/// One step, k. x are the states of the plants and their measurements, u the forces that act over
/// [k, k + 1). x⁻ is not published yet, x* is published and awaits answers, x⁺ ends the period.
///
///     go_on(now):                               // after each event and at each deadline
///       if between steps:                       // x⁻(k)
///         publish_if_allowed(now)
///       else if awaiting answers and pacing.close(now):
///         finish_step(now)
///
///     publish_if_allowed(now):
///       return unless the operator, the recorders and the schedule allow step k
///       x*(k) ← x⁻(k)                           // Outputs::send_states
///
///     pacing.close(now):                        // LockstepPacing, RealtimePacing
///       take the accepted answers to x*(k)
///       where one is missing: resend x*(k), pass over a silent client, hold u, or fail safe
///       return true if every vehicle has its u(k)
///
///     finish_step(now):
///       if all answers say that the mission is finished: end the run  // u(k) does not act
///       record x*(k), u(k)
///       x⁺(k) ← x*(k) moved by u(k) over one period                   // Fleet::advance
///       k ← k + 1, x⁻(k) ← x⁺(k − 1)
///       publish_if_allowed(now)
class ServerCore {
 public:
  struct Start {
    std::uint64_t run_id = 0;
    bool claims = true;          ///< false if this server has its vehicles from an earlier run
    bool begins_paused = false;  ///< as the run before a reset was
  };

  /// The run of `fleet`. It has been announced in sls/parameters at `now`.
  ServerCore(const config::Scenario& scenario, const Start& start, std::unique_ptr<Fleet> fleet,
             Outputs& outputs, sync::Time now);
  ServerCore(const ServerCore&) = delete;
  ServerCore& operator=(const ServerCore&) = delete;

  enum class Phase {
    kClaiming,           ///< listens whether another server has the vehicles
    kGathering,          ///< until the expected participants are ready
    kResting,            ///< between two steps, held by an operator
    kAwaitingRecorders,  ///< between two steps
    kAwaitingDue,        ///< between two steps, in real time
    kAwaitingAnswers,    ///< the states of the step in work were published
    kEnded,
  };
  Phase phase() const { return phase_; }

  /// A sample of sls/command came. It may come at any time: before its step was published, an
  /// answer is early.
  void on_commands(CommandSample& sample);
  /// A request of an operator came.
  void on_request(const SimControl& request, const Surroundings& around, sync::Time now);
  /// Looks around: stop signal, claims, participants, mistakes, status. Call it when is_look_due.
  void on_look(Surroundings& around, sync::Time now);
  /// The time is `now`.
  void on_time(sync::Time now);
  /// The shell could not do what the core wanted. Also after the end: after a reset the next run
  /// may not be made, and a finished one, which stays finished, not be published.
  void on_failure(const std::string& reason, sync::Time now);

  /// The main thread has woken: looks, calls `deliver()` for what waits, and goes on, in the
  /// order that the rules need. `read_clock()`: the time.
  template <class Deliver, class ReadClock>
  void on_wake(Surroundings& around, const Deliver& deliver, const ReadClock& read_clock) {
    if (has_news(around)) on_look(around, read_clock());
    deliver();
    on_time(read_clock());
    if (const sync::Time time = read_clock(); is_look_due(time)) on_look(around, time);
  }
  /// True if answers may be given to the core as they come, not only when the main thread wakes.
  bool takes_answers_at_once(const Surroundings& around) const {
    return phase_ == Phase::kAwaitingAnswers && !has_news(around);
  }

  bool is_look_due(sync::Time now) const { return now >= looked_ + calc_look_interval(); }
  /// True if the run has news for on_look, which no plain step may precede.
  bool has_news(const Surroundings& around) const { return parts_.watch.has_news(around); }
  /// When on_look or on_time is due.
  sync::Time next_deadline() const;

  enum class End { kFinished, kReset, kFailed };
  /// In phase kEnded: how.
  End end() const { return end_; }
  /// Why the run failed; or, although it was finished, what the server could not tell the others.
  const std::string& error() const { return error_; }

  std::uint64_t run_id() const { return parts_.run_id; }
  bool is_paused() const { return parts_.control.is_paused(); }
  /// True once participants may have joined.
  bool is_known() const { return parts_.report.has_published(); }
  /// After the last run: the end of the server, which begins at `now`.
  Leaving leave(sync::Time now) const;
  /// After a reset: how the next run begins.
  Start make_next_start() const { return {0, !is_known(), is_paused()}; }

 private:
  /// Does `work`; an exception of it ends the run.
  template <class Work>
  void guard(sync::Time now, Work work);

  /// Offers each answer to the gate of its vehicle, and tells the verdict.
  void judge(CommandSample& sample);
  void note(Verdict verdict, Vehicle& vehicle, const OfferedAnswer& offered,
            const CommandSample& sample);
  void begin_flight(sync::Time now);
  void go_on(sync::Time now);
  void publish_if_allowed(sync::Time now);
  void end_rest(sync::Time now);
  void finish_step(sync::Time now);
  void keep_house(Surroundings& around, sync::Time now);
  void end_run(End end, RunPhase phase, const std::string& reason, sync::Time now);
  sync::Duration calc_look_interval() const;
  bool is_between_steps() const;

  RunParts parts_;
  Preparation preparation_;
  RecorderWait recorders_;
  const std::unique_ptr<Pacing> pacing_;
  Phase phase_ = Phase::kClaiming;
  sync::Time looked_{};
  sync::Time published_{};  // the states of the step in work
  sync::Time rest_began_{};
  End end_ = End::kFailed;
  std::string error_;
};

}  // namespace sls::sim
