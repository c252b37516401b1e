#include "sim_server/core_loop.hpp"

#include <algorithm>
#include <exception>

#include "common/app/wait.hpp"

namespace sls::sim {
namespace {

sync::Time now() { return app::awake_clock().now(); }

}  // namespace

void CoreLoop::run(ServerCore& core) {
  commands_.take_all();  // of an earlier run
  std::unique_lock lock(core_mutex_);
  core_ = &core;
  unanswered_ = now();
  while (core.phase() != ServerCore::Phase::kEnded) {
    deadline_ = core.next_deadline();
    awaits_answers_ = core.phase() == ServerCore::Phase::kAwaitingAnswers;
    lock.unlock();
    write_waiting(core);
    const bool is_late = wait_until_due();
    app::log_stop();
    main_wants_core_ = true;
    lock.lock();
    main_wants_core_ = false;
    if (const auto time = now(); is_late && !core.is_look_due(time)) unanswered_ = time;
    core.on_wake(
        around_, [&] { deliver_events(core); }, now);
  }
  core_ = nullptr;
  lock.unlock();
  write_waiting(core);
}

void CoreLoop::write_waiting(ServerCore& core) {
  while (backlog_.is_waiting()) {
    try {
      backlog_.write_waiting();
    } catch (const std::exception& error) {  // such as a reader that acknowledges nothing
      const std::lock_guard lock(core_mutex_);
      core.on_failure(error.what(), now());
    }
  }
}

/// Returns true if the deadline has passed, false if there is something else to do.
bool CoreLoop::wait_until_due() {
  do {
    // Each step that the middleware's thread takes meanwhile moves the deadline.
    const sync::Time deadline = deadline_.load();
    sleeps_until_ = deadline;
    app::awake_clock().expect_look(deadline);
    const bool has_slack = is_lockstep_ && awaits_answers_;
    const auto slack = has_slack ? calc_slack(now() - unanswered_) : Clock::duration::zero();
    if (backlog_.is_waiting() || commands_.wait(app::awake_clock().to_steady(deadline + slack)))
      return false;
  } while (now() < deadline_.load());
  return true;
}

CoreLoop::Clock::duration CoreLoop::calc_slack(Clock::duration duration) {
  return std::min<Clock::duration>(std::chrono::milliseconds(10), duration / 32);
}

void CoreLoop::deliver_events(ServerCore& core) {
  for (const SimControl& request : requests_.take_all()) core.on_request(request, around_, now());
  for (CommandSample& sample : commands_.take_all()) core.on_commands(sample);
}

/// The middleware's thread has called the core: wakes the main thread if it has work now, or
/// sleeps too long.
void CoreLoop::note_deadline() {
  const sync::Time deadline = core_->next_deadline();
  deadline_ = deadline;
  if (deadline < sleeps_until_.load() || backlog_.is_waiting() ||
      core_->phase() != ServerCore::Phase::kAwaitingAnswers)
    commands_.interrupt();
}

}  // namespace sls::sim
