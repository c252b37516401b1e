// Tests common/bus/fastdds/shared_locks.cpp, which this program links.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <pthread.h>
#include <semaphore.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <csignal>
#include <ctime>
#include <string>
#include <thread>

#include "common/bus/fastdds/stale_segments.hpp"
#include "tests/support/waiting.hpp"

namespace sls::bus {
namespace {

using Clock = std::chrono::system_clock;  // the deadlines use it

constexpr double kLong_s = 60;  // no correct wait lasts as long
constexpr double kSlow_s = 30;  // an early return takes less, on any machine

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

  void SetUp() override { make_port(-1); }

  /// In the memory of the file, or of none if it is −1.
  void make_port(int file) {
    void* memory = mmap(nullptr, sizeof(Port), PROT_READ | PROT_WRITE,
                        MAP_SHARED | (file < 0 ? MAP_ANONYMOUS : 0), file, 0);
    ASSERT_NE(memory, MAP_FAILED);
    port_ = static_cast<Port*>(memory);
    pthread_mutexattr_t attributes;
    pthread_mutexattr_init(&attributes);
    ASSERT_EQ(pthread_mutexattr_setpshared(&attributes, PTHREAD_PROCESS_SHARED), 0);
    ASSERT_EQ(pthread_mutex_init(&port_->mutex, &attributes), 0);
    ASSERT_EQ(sem_init(&port_->semaphore, 1, 0), 0);
  }

  // The port stays mapped: shared_locks.cpp remembers a reader's own locks by address, and a later
  // lock at the same address would count as one of them.
  void TearDown() override {
    if (holder_ > 0) {
      kill(holder_, SIGKILL);
      waitpid(holder_, nullptr, 0);
    }
  }

  /// Starts a process that takes the lock, sends itself the signal, and releases the lock. With
  /// signal 0 it keeps the lock.
  void start_holder(int signal) {
    holder_ = fork();
    ASSERT_GE(holder_, 0);
    if (holder_ == 0) {
      pthread_mutex_lock(&port_->mutex);
      if (signal == 0) {
        sem_post(&port_->semaphore);
        while (true) pause();
      }
      raise(signal);
      pthread_mutex_unlock(&port_->mutex);
      _exit(0);
    }
    if (signal == 0) {
      sem_wait(&port_->semaphore);
      return;
    }
    int status = 0;
    ASSERT_EQ(waitpid(holder_, &status, WUNTRACED), holder_);
    if (!WIFSTOPPED(status)) holder_ = 0;
  }

  int lock_within(double seconds) {
    const timespec deadline = after(seconds);
    return pthread_mutex_timedlock(&port_->mutex, &deadline);
  }

  /// The error of a wait at the port, 0 if it was woken.
  int wait_within(double seconds) {
    const timespec deadline = after(seconds);
    return sem_timedwait(&port_->semaphore, &deadline) == 0 ? 0 : errno;
  }

  /// A thread that waits for the lock. As a reader of the port it first waits for messages. The
  /// constructor returns when the thread waits for the lock.
  class Waiting {
   public:
    explicit Waiting(SharedLocksTest& test, bool is_reader = false, double patience_s = kLong_s)
        : thread_([this, &test, is_reader, patience_s] {
            if (is_reader) {
              EXPECT_EQ(test.wait_within(kLong_s), ETIMEDOUT);
            }
            id_ = gettid();
            result_ = test.lock_within(patience_s);
            if (result_ == 0) pthread_mutex_unlock(&test.port_->mutex);
          }) {
      EXPECT_TRUE(test::wait_until([this] { return id_ != 0 && test::find_state(id_) == 'S'; }));
    }
    /// The result of the wait for the lock.
    int finish() {
      thread_.join();
      return result_;
    }

   private:
    std::atomic<pid_t> id_{0};
    int result_ = -1;
    std::thread thread_;
  };

  /// The stopped holder of the reader's lock gets the signal after the reader's deadline; expects
  /// that the reader waits until then and takes the lock.
  void expect_reader_waits_until(int signal) {
    start_holder(SIGSTOP);
    Waiting reader(*this, true, 0.2);
    std::this_thread::sleep_for(std::chrono::milliseconds(400));
    kill(holder_, signal);
    EXPECT_EQ(reader.finish(), 0);
  }

  void continue_holder() {
    kill(holder_, SIGCONT);
    while (waitpid(holder_, nullptr, 0) != holder_) {
    }
    holder_ = 0;
  }

  Port* port_ = nullptr;
  pid_t holder_ = 0;
};

/// The same in the memory of an endpoint that shares data.
class SharedDataLocksTest : public SharedLocksTest {
 protected:
  void SetUp() override {
    const std::string name = std::string("/") + kDataSharingPrefix + std::to_string(getpid());
    const int file = shm_open(name.c_str(), O_CREAT | O_EXCL | O_RDWR, 0600);
    ASSERT_GE(file, 0);
    shm_unlink(name.c_str());
    ASSERT_EQ(ftruncate(file, sizeof(Port)), 0);
    make_port(file);
    close(file);
  }
};

TEST_F(SharedLocksTest, TheLockOfADeadProcessGoesToTheNext) {
  start_holder(SIGKILL);
  for (int time = 0; time < 2; ++time) {
    ASSERT_EQ(lock_within(kLong_s), 0);
    ASSERT_EQ(pthread_mutex_unlock(&port_->mutex), 0);
  }
}

TEST_F(SharedLocksTest, NoProcessWaitsForAStoppedOne) {
  start_holder(SIGSTOP);
  const auto start = Clock::now();
  for (int time = 0; time < 2; ++time) EXPECT_EQ(lock_within(kLong_s), ETIMEDOUT);
  EXPECT_LT(seconds_since(start), kSlow_s);
  continue_holder();
  EXPECT_EQ(lock_within(kLong_s), 0);
  EXPECT_EQ(pthread_mutex_unlock(&port_->mutex), 0);
}

TEST_F(SharedDataLocksTest, AThreadGoesOnWithoutTheLockOfAStoppedProcess) {
  start_holder(SIGSTOP);
  const auto start = Clock::now();
  for (int time = 0; time < 2; ++time) {
    EXPECT_EQ(lock_within(kLong_s), 0);
    EXPECT_EQ(pthread_mutex_unlock(&port_->mutex), 0);
  }
  EXPECT_LT(seconds_since(start), kSlow_s);
  continue_holder();  // it still has the lock, and gives it back
  EXPECT_EQ(lock_within(kLong_s), 0);
  EXPECT_EQ(pthread_mutex_unlock(&port_->mutex), 0);
}

TEST_F(SharedDataLocksTest, TheLockOfADeadProcessGoesToTheNext) {
  start_holder(SIGKILL);
  EXPECT_EQ(lock_within(kLong_s), 0);
  EXPECT_EQ(pthread_mutex_unlock(&port_->mutex), 0);
}

TEST_F(SharedDataLocksTest, AReaderLooksForDataWithoutBeingWoken) {
  EXPECT_EQ(sem_wait(&port_->semaphore), 0);
}

TEST_F(SharedLocksTest, ASlowProcessIsWaitedFor) {
  ASSERT_EQ(pthread_mutex_lock(&port_->mutex), 0);
  Waiting waiting(*this);
  std::this_thread::sleep_for(std::chrono::milliseconds(300));  // longer than for a stopped process
  ASSERT_EQ(pthread_mutex_unlock(&port_->mutex), 0);
  EXPECT_EQ(waiting.finish(), 0);
}

TEST_F(SharedLocksTest, TheLockOfADyingProcessGoesToAWaitingOne) {
  start_holder(0);
  Waiting waiting(*this);
  kill(holder_, SIGKILL);
  EXPECT_EQ(waiting.finish(), 0);
}

TEST_F(SharedLocksTest, AReaderLooksAtItsPortBeforeItsTime) {
  const auto start = Clock::now();
  EXPECT_EQ(wait_within(kLong_s), ETIMEDOUT);
  EXPECT_LT(seconds_since(start), kSlow_s);
}

int count(sem_t& semaphore) {
  int value = -1;
  sem_getvalue(&semaphore, &value);
  return value;
}

TEST_F(SharedLocksTest, AReaderIsWokenWhenTheWriterHasReleasedItsLastLock) {
  pthread_mutex_t inner;
  pthread_mutexattr_t attributes;
  pthread_mutexattr_init(&attributes);
  pthread_mutexattr_setpshared(&attributes, PTHREAD_PROCESS_SHARED);
  pthread_mutex_init(&inner, &attributes);
  ASSERT_EQ(lock_within(kLong_s), 0);
  const timespec deadline = after(kLong_s);
  ASSERT_EQ(pthread_mutex_timedlock(&inner, &deadline), 0);
  for (int i = 0; i < 3; ++i) EXPECT_EQ(sem_post(&port_->semaphore), 0);
  pthread_mutex_unlock(&inner);
  EXPECT_EQ(count(port_->semaphore), 0);
  pthread_mutex_unlock(&port_->mutex);
  EXPECT_EQ(count(port_->semaphore), 3);
  sem_post(&port_->semaphore);  // without a lock
  EXPECT_EQ(count(port_->semaphore), 4);
}

TEST_F(SharedLocksTest, NoWakingIsLostHoweverManyThereAre) {
  ASSERT_EQ(lock_within(kLong_s), 0);
  for (int i = 0; i < 50; ++i) sem_post(&port_->semaphore);
  pthread_mutex_unlock(&port_->mutex);
  EXPECT_EQ(count(port_->semaphore), 50);
}

TEST_F(SharedLocksTest, ASignalHandlerMayWakeAReaderToo) {
  static sem_t* semaphore = nullptr;
  semaphore = &port_->semaphore;
  const auto before = std::signal(SIGUSR1, [](int) { sem_post(semaphore); });
  ASSERT_EQ(lock_within(kLong_s), 0);
  raise(SIGUSR1);
  sem_post(semaphore);
  pthread_mutex_unlock(&port_->mutex);
  raise(SIGUSR1);
  std::signal(SIGUSR1, before);
  EXPECT_EQ(count(port_->semaphore), 3);
}

TEST_F(SharedLocksTest, AThreadThatWaitsForALockInVainWakesReaders) {
  start_holder(SIGSTOP);
  EXPECT_EQ(lock_within(kSlow_s), ETIMEDOUT);
  sem_post(&port_->semaphore);
  EXPECT_EQ(count(port_->semaphore), 1);
}

TEST_F(SharedLocksTest, AWaitForANamedSemaphoreIsNotCutShort) {
  const std::string name = "/sls_test_" + std::to_string(getpid());
  sem_t* semaphore = sem_open(name.c_str(), O_CREAT | O_EXCL, 0600, 0);
  ASSERT_NE(semaphore, SEM_FAILED);
  sem_unlink(name.c_str());
  const auto start = Clock::now();
  const timespec deadline = after(0.5);
  EXPECT_EQ(sem_timedwait(semaphore, &deadline), -1);
  EXPECT_GE(seconds_since(start), 0.5);
  sem_close(semaphore);
}

// Fast DDS #6484: a thread that replaces the port of a process killed inside a message.
TEST_F(SharedLocksTest, AThreadMayTakeALockTwice) {
  const auto start = Clock::now();
  for (int time = 0; time < 2; ++time) ASSERT_EQ(lock_within(kLong_s), 0);
  EXPECT_LT(seconds_since(start), kSlow_s);
  ASSERT_EQ(pthread_mutex_unlock(&port_->mutex), 0);
  Waiting waiting(*this);  // still locked
  ASSERT_EQ(pthread_mutex_unlock(&port_->mutex), 0);
  EXPECT_EQ(waiting.finish(), 0);
}

// Boost 1.83 in a program without shared_locks.cpp does so with the lock of a dead process.
TEST_F(SharedLocksTest, AReaderRepairsALockThatAnotherProcessHasMadeUseless) {
  start_holder(SIGKILL);
  ASSERT_EQ(pthread_mutex_lock(&port_->mutex), EOWNERDEAD);
  ASSERT_EQ(pthread_mutex_unlock(&port_->mutex), 0);
  ASSERT_EQ(lock_within(kLong_s), ENOTRECOVERABLE);
  std::thread reader([this] {
    EXPECT_EQ(wait_within(kLong_s), ETIMEDOUT);
    EXPECT_EQ(lock_within(kLong_s), 0);
    EXPECT_EQ(pthread_mutex_unlock(&port_->mutex), 0);
  });
  reader.join();
  ASSERT_EQ(lock_within(kLong_s), 0);
  EXPECT_EQ(pthread_mutex_unlock(&port_->mutex), 0);
}

TEST_F(SharedLocksTest, AReaderWaitsForItsOwnPortUntilAStoppedProcessGoesOn) {
  expect_reader_waits_until(SIGCONT);
}

TEST_F(SharedLocksTest, AReaderWaitsForItsOwnPortUntilAStoppedProcessDies) {
  expect_reader_waits_until(SIGKILL);
}

}  // namespace
}  // namespace sls::bus
