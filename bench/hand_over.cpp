#include "bench/hand_over.hpp"

#include <semaphore.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <csignal>
#include <nlohmann/json.hpp>

#include "common/app/run_error.hpp"
#include "common/app/stop_signal.hpp"

namespace sls::bench {
namespace {

using Clock = std::chrono::steady_clock;
using Microseconds = std::chrono::duration<double, std::micro>;

constexpr auto kLongestSpin = std::chrono::microseconds(50);
constexpr std::time_t kRoundsLimit_s = 60;

/// Returns true when it is this process's turn; false after the deadline or a stop signal.
bool wait(sem_t& turn, bool may_spin, const timespec& deadline) {
  if (may_spin) {
    const auto end = Clock::now() + kLongestSpin;
    do
      if (sem_trywait(&turn) == 0) return true;
    while (Clock::now() < end);
  }
  while (sem_timedwait(&turn, &deadline) != 0)
    if (errno != EINTR || app::stop_signal() != 0) return false;
  return true;
}

}  // namespace

/// Semaphores between processes are futexes with a count: a post calls the kernel only if a
/// process sleeps. Fast DDS also uses them to wake the readers of a shared-memory port.
struct HandOver::Turns {
  sem_t ours, theirs;
};

HandOver::HandOver(const HandOverOptions& options) : options_(options) {
  void* memory =
      mmap(nullptr, sizeof(Turns), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
  if (memory == MAP_FAILED) throw app::RunError("hand-over: no memory to share");
  turns_ = static_cast<Turns*>(memory);
  sem_init(&turns_->ours, 1, 0);
  sem_init(&turns_->theirs, 1, 0);
  clock_gettime(CLOCK_REALTIME, &deadline_);
  deadline_.tv_sec += kRoundsLimit_s;
  other_ = fork();
  if (other_ < 0) throw app::RunError("hand-over: cannot start another process");
  if (other_ > 0) return;
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  while (wait(turns_->theirs, options_.may_spin, deadline_)) sem_post(&turns_->ours);
  _exit(1);
}

HandOver::~HandOver() {
  kill(other_, SIGKILL);
  waitpid(other_, nullptr, 0);
  munmap(turns_, sizeof(Turns));
}

void HandOver::take_turns(std::uint64_t rounds) {
  const auto work = std::chrono::duration_cast<Clock::duration>(Microseconds(options_.work_us));
  for (std::uint64_t i = 0; i < rounds; ++i) {
    for (const auto end = Clock::now() + work; Clock::now() < end;) continue;
    sem_post(&turns_->theirs);
    if (!wait(turns_->ours, options_.may_spin, deadline_))
      throw app::RunError("hand-over: the turn did not come back");
    if (app::stop_signal() != 0) throw app::RunError("hand-over: interrupted");
  }
}

nlohmann::json HandOver::measure() {
  take_turns(options_.warm_up);
  const auto began = Clock::now();
  take_turns(options_.rounds);
  const Microseconds elapsed = Clock::now() - began;
  return {{"mean_us", elapsed.count() / static_cast<double>(options_.rounds)}};
}

}  // namespace sls::bench
