#include "common/bus/shared_locks.hpp"

#include <gtest/gtest.h>
#include <pthread.h>
#include <semaphore.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <cmath>
#include <ctime>
#include <thread>

namespace sls::bus {
namespace {

using Clock = std::chrono::system_clock;  // that of the deadlines

constexpr double kLong_s = 60;  // nobody has waited for as long on purpose
constexpr double kSlow_s = 30;  // nobody needs as long, on any machine

timespec after(double seconds) {
  timespec time{};
  clock_gettime(CLOCK_REALTIME, &time);
  time.tv_sec += static_cast<time_t>(std::floor(seconds));
  time.tv_nsec += static_cast<long>((seconds - std::floor(seconds)) * 1e9);
  if (time.tv_nsec >= 1'000'000'000) ++time.tv_sec, time.tv_nsec -= 1'000'000'000;
  return time;
}

double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

/// A mutex and a semaphore between processes, made as the middleware makes those of a port.
class SharedLocksTest : public testing::Test {
 protected:
  struct Port {
    pthread_mutex_t mutex;
    sem_t semaphore;
  };

  void SetUp() override {
    guard_shared_locks();
    void* memory =
        mmap(nullptr, sizeof(Port), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
    ASSERT_NE(memory, MAP_FAILED);
    port_ = static_cast<Port*>(memory);
    pthread_mutexattr_t attributes;
    pthread_mutexattr_init(&attributes);
    ASSERT_EQ(pthread_mutexattr_setpshared(&attributes, PTHREAD_PROCESS_SHARED), 0);
    ASSERT_EQ(pthread_mutex_init(&port_->mutex, &attributes), 0);
    ASSERT_EQ(sem_init(&port_->semaphore, 1, 0), 0);
  }

  void TearDown() override {
    if (holder_ > 0) {
      kill(holder_, SIGKILL);
      waitpid(holder_, nullptr, 0);
    }
    munmap(port_, sizeof(Port));
  }

  /// A process that takes the lock, sends itself the signal, and gives the lock back.
  void start_holder(int signal) {
    holder_ = fork();
    ASSERT_GE(holder_, 0);
    if (holder_ == 0) {
      pthread_mutex_lock(&port_->mutex);
      raise(signal);
      pthread_mutex_unlock(&port_->mutex);
      _exit(0);
    }
    int status = 0;
    ASSERT_EQ(waitpid(holder_, &status, WUNTRACED), holder_);
    if (!WIFSTOPPED(status)) holder_ = 0;
  }

  int lock_within(double seconds) {
    const timespec deadline = after(seconds);
    return pthread_mutex_timedlock(&port_->mutex, &deadline);
  }

  /// The error of a wait at the port, 0 where somebody woke it.
  int wait_within(double seconds) {
    const timespec deadline = after(seconds);
    return sem_timedwait(&port_->semaphore, &deadline) == 0 ? 0 : errno;
  }

  /// Of a thread like the library's that reads a port: it waits for messages, then takes the lock
  /// again, behind a stopped process that gets the signal when the reader's deadline is over.
  void expect_reader_waits_until(int signal) {
    start_holder(SIGSTOP);
    const auto start = Clock::now();
    std::thread reader([&] {
      EXPECT_EQ(wait_within(kLong_s), ETIMEDOUT);
      EXPECT_EQ(lock_within(0.2), 0);
      EXPECT_GE(seconds_since(start), 0.5);
      EXPECT_EQ(pthread_mutex_unlock(&port_->mutex), 0);
    });
    while (seconds_since(start) < 0.5) std::this_thread::yield();
    kill(holder_, signal);
    reader.join();
  }

  Port* port_ = nullptr;
  pid_t holder_ = 0;
};

TEST_F(SharedLocksTest, TheLockOfADeadProcessGoesToTheNext) {
  start_holder(SIGKILL);
  for (int time = 0; time < 2; ++time) {
    ASSERT_EQ(lock_within(kLong_s), 0);
    ASSERT_EQ(pthread_mutex_unlock(&port_->mutex), 0);
  }
}

TEST_F(SharedLocksTest, NobodyWaitsForAStoppedProcess) {
  start_holder(SIGSTOP);
  const auto start = Clock::now();
  for (int time = 0; time < 2; ++time) EXPECT_EQ(lock_within(kLong_s), ETIMEDOUT);
  EXPECT_LT(seconds_since(start), kSlow_s);
  kill(holder_, SIGCONT);
  while (waitpid(holder_, nullptr, 0) != holder_) {
  }
  holder_ = 0;
  EXPECT_EQ(lock_within(kLong_s), 0);
  EXPECT_EQ(pthread_mutex_unlock(&port_->mutex), 0);
}

TEST_F(SharedLocksTest, ButForOneThatIsOnlySlow) {
  ASSERT_EQ(pthread_mutex_lock(&port_->mutex), 0);
  int result = -1;
  const auto start = Clock::now();
  std::thread waiting([&] {
    result = lock_within(kLong_s);
    pthread_mutex_unlock(&port_->mutex);
  });
  while (seconds_since(start) < 0.3) std::this_thread::yield();  // longer than for a stopped one
  pthread_mutex_unlock(&port_->mutex);
  waiting.join();
  EXPECT_EQ(result, 0);
}

TEST_F(SharedLocksTest, AReaderLooksAtItsPortBeforeItsTime) {
  const auto start = Clock::now();
  EXPECT_EQ(wait_within(kLong_s), ETIMEDOUT);
  EXPECT_LT(seconds_since(start), kSlow_s);
}

TEST_F(SharedLocksTest, WhoWaitsForALockWaitsToTheEnd) {
  const auto start = Clock::now();
  EXPECT_EQ(wait_within(0.5), ETIMEDOUT);
  EXPECT_GE(seconds_since(start), 0.5);
}

TEST_F(SharedLocksTest, AReaderWaitsForItsOwnPortUntilAStoppedProcessGoesOn) {
  expect_reader_waits_until(SIGCONT);
}

TEST_F(SharedLocksTest, AReaderWaitsForItsOwnPortUntilAStoppedProcessDies) {
  expect_reader_waits_until(SIGKILL);
}

}  // namespace
}  // namespace sls::bus
