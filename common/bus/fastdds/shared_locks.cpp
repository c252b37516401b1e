/// Replaces six functions of the C library in the programs that link this file (sim_server,
/// control_client, recorder). These programs then keep working when another process is killed or
/// stopped while it holds a lock in shared memory.
///
/// Fast DDS 2.9 passes messages on one machine through shared-memory ports, each with a mutex and a
/// semaphore. At 5,000 steps/s about one in fourteen SIGKILLs hit a process that held such a mutex.
/// Then every write of every other process to that port took 1 s, until `healthy_check_timeout_ms`
/// was over. So in these programs
/// - a mutex shared by several processes is robust: when its holder dies, the next waiting thread
///   gets it;
/// - a thread that waits for a mutex whose holder is stopped gives up after 50 ms instead of 1 s:
///   that message is lost, and a reliable stream sends it again. This requires that both processes
///   are in one PID namespace, so it does not work from one container to another;
/// - a reader polls its port ten times a second, because a process may die after it has written a
///   message and before it wakes the reader;
/// - a thread that shares data (data_sharing.hpp) goes on without the lock of a notification whose
///   holder is stopped, and a reader looks for data ten times a second;
/// - a reader waits for the locks of its own port without a time limit, because the library ends
///   the process of a reader that gives up after 1 s. But a process that closes its ports goes on
///   without a lock whose holder is stopped, because nothing reads these ports any more;
/// - a writer wakes a reader after it has released the lock that the reader wants next. Fast DDS
///   posts the semaphore inside the lock: a reader on the same processor then runs at once, finds
///   the lock taken, sleeps, and is woken a second time (trap 47).
///
/// Upstream: #5469 (open) has the symptom; no issue names the locks. To be deleted when the mutexes
/// of ports are robust and a reader does not rely on being woken; tests/system/shared_lock_test.cpp
/// then passes without this file.
#include <dlfcn.h>
#include <linux/futex.h>
#include <pthread.h>
#include <semaphore.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cinttypes>
#include <cstdint>
#include <cstdio>
#include <ctime>
#include <fstream>
#include <string>
#include <utility>

#include "common/bus/fastdds/adaptive_spin.hpp"
#include "common/bus/fastdds/shared_locks.hpp"
#include "common/bus/fastdds/stale_segments.hpp"
#include "common/bus/spinning.hpp"

namespace sls::bus {
namespace {

constexpr std::int64_t kSecond_ns = 1'000'000'000;
constexpr std::int64_t kPatienceWithStopped_ns = kSecond_ns / 20;
constexpr std::int64_t kLook_ns = kSecond_ns / 10;
constexpr int kRobustBit = 16;  // of the kind of a mutex in the C library

/// The latest locks of the ports that threads of this process read. A port has two, which a reader
/// takes one after the other after its wait for messages. A reader waits for them without a time
/// limit: if it gives up, the library ends the process or replaces the port. The same holds for a
/// process that closes the port.
std::array<std::atomic<const pthread_mutex_t*>, 16> own_locks{};
thread_local int own_locks_to_come = 0;

bool is_own(const pthread_mutex_t* mutex) {
  return std::any_of(own_locks.begin(), own_locks.end(),
                     [mutex](const auto& lock) { return lock == mutex; });
}

void remember_as_own(const pthread_mutex_t* mutex) {
  static std::atomic<std::size_t> count{0};
  if (!is_own(mutex)) own_locks[count++ % own_locks.size()] = mutex;
}

/// The C library's function of that name, which ours replaces.
template <class Function>
Function* find_next(Function*, const char* name) {
  return reinterpret_cast<Function*>(dlsym(RTLD_NEXT, name));
}

std::int64_t to_ns(const timespec& time) { return time.tv_sec * kSecond_ns + time.tv_nsec; }

timespec to_timespec(std::int64_t time_ns) {
  timespec time{};
  time.tv_sec = time_ns / kSecond_ns;
  time.tv_nsec = time_ns % kSecond_ns;
  return time;
}

std::int64_t now_ns() {  // of the clock of the deadlines
  timespec now{};
  clock_gettime(CLOCK_REALTIME, &now);
  return to_ns(now);
}

/// The earlier of `deadline` and the time `patience_ns` from now.
timespec limit(const timespec& deadline, std::int64_t patience_ns) {
  return to_timespec(std::min(to_ns(deadline), now_ns() + patience_ns));
}

/// Repairs a lock that this thread got because its holder died. The lock of a port guards a ring of
/// messages and the list of waiting readers. Their state stays usable, except if the process died
/// between the two instructions that reserve and fill a place in the ring.
int take_over(int result, pthread_mutex_t* mutex) {
  return result == EOWNERDEAD ? pthread_mutex_consistent(mutex) : result;
}

/// The latest lock between processes that this thread has taken. Fast DDS takes the lock of a port
/// twice when it replaces the port of a process that was killed inside a message (#6484).
thread_local const pthread_mutex_t* held = nullptr;
thread_local bool is_held_twice = false;

/// The locks between processes that this thread holds, and the readers to wake when it holds none.
/// A process that dies before it has woken them delays them until they look by themselves.
struct Waking {
  int locks = 0;
  std::atomic<std::size_t> count{0};
  std::array<sem_t*, 8> semaphores;
};
thread_local Waking waking;

/// A few locks that this thread remembers, the latest ones.
class Locks {
 public:
  bool hold(const pthread_mutex_t* lock) const {
    return std::find(locks_.begin(), locks_.end(), lock) != locks_.end();
  }
  void add(const pthread_mutex_t* lock) {
    if (!hold(lock)) locks_[next_++ % locks_.size()] = lock;
  }
  /// False if there is no such lock.
  bool drop(const pthread_mutex_t* lock) {
    const auto found = std::find(locks_.begin(), locks_.end(), lock);
    if (found == locks_.end()) return false;
    *found = nullptr;
    return true;
  }

 private:
  std::array<const pthread_mutex_t*, 4> locks_{};
  std::size_t next_ = 0;
};

thread_local Locks stopped;  // their holders were stopped when this thread wanted them
thread_local Locks forgone;  // this thread goes on without them, until it "unlocks" them

/// True for an address inside the memory of an endpoint that shares data.
bool is_of_shared_data(const void* address) {
  std::ifstream maps("/proc/self/maps");
  std::string line;
  while (std::getline(maps, line)) {
    std::uintptr_t begin = 0, end = 0;
    if (std::sscanf(line.c_str(), "%" SCNxPTR "-%" SCNxPTR, &begin, &end) != 2) continue;
    const auto place = reinterpret_cast<std::uintptr_t>(address);
    if (begin <= place && place < end) return line.find(kDataSharingPrefix) != line.npos;
  }
  return false;
}

/// Waits at a semaphore in shared memory for a message: polls, then sleeps until `look`.
int wait_for_message(sem_t* semaphore, const timespec& look) {
  static const auto sleep_until = find_next(&sem_timedwait, "sem_timedwait");
  thread_local AdaptiveSpin spin(16);
  if (is_spinning.load(std::memory_order_relaxed) &&
      spin.wait_for([semaphore] { return sem_trywait(semaphore) == 0; }))
    return 0;
  return sleep_until(semaphore, &look);
}

/// True for the semaphore of a port, which lies inside the port's memory. A named semaphore has its
/// own mapping, so it begins a page.
bool is_of_port(const sem_t* semaphore) {
  static const auto page_size = static_cast<std::uintptr_t>(sysconf(_SC_PAGESIZE));
  return reinterpret_cast<std::uintptr_t>(semaphore) % page_size != 0;
}

/// True if the thread that holds the mutex is stopped, by a signal or a debugger.
bool is_holder_stopped(const pthread_mutex_t& mutex) {
  // The first word of a robust mutex has the thread id of the holder, for the kernel (futex(2),
  // robust lists).
  const auto word =
      __atomic_load_n(reinterpret_cast<const std::uint32_t*>(&mutex), __ATOMIC_RELAXED);
  std::ifstream file("/proc/" + std::to_string(word & FUTEX_TID_MASK) + "/stat");
  std::string line;
  std::getline(file, line);
  const auto name_end = line.rfind(") ");
  return name_end != std::string::npos && name_end + 2 < line.size() &&
         (line[name_end + 2] == 'T' || line[name_end + 2] == 't');
}

/// Takes a lock of our own port without a time limit. If this process is leaving and the holder is
/// stopped, it goes on without the lock.
int lock_own(decltype(pthread_mutex_timedlock)* lock_until, pthread_mutex_t* mutex) {
  while (true) {
    const timespec look = to_timespec(now_ns() + kPatienceWithStopped_ns);
    const int result = take_over(lock_until(mutex, &look), mutex);
    // A process without this file was the first to get the lock of a dead one. Boost 1.83 then
    // makes it useless to everybody. Setting the owner makes it usable, as pthread_mutex_consistent
    // does.
    if (result == ENOTRECOVERABLE) __atomic_store_n(&mutex->__data.__owner, 0, __ATOMIC_RELAXED);
    if (result != ETIMEDOUT && result != ENOTRECOVERABLE) return result;
    if (!is_leaving.load(std::memory_order_relaxed)) continue;
    static std::atomic<bool> is_forgone{false};
    if (is_forgone || is_holder_stopped(*mutex)) {
      // The first thread gives the others time to go on before it unmaps the memory they use.
      if (!is_forgone.exchange(true)) usleep(4 * kPatienceWithStopped_ns / 1000);
      return 0;
    }
  }
}

/// The result for a lock whose holder is stopped. Over a port's messages nothing may be done
/// without it; a notification of shared data may be told twice or late.
int give_up(const pthread_mutex_t* mutex) {
  if (!is_of_shared_data(mutex)) return ETIMEDOUT;
  forgone.add(mutex);
  return 0;
}

/// Takes a lock of another process's port or of shared data, with little patience with a stopped
/// holder. Waits for another holder of shared data without a time limit, because the library ends
/// the process of a thread that gives up.
int lock_other(decltype(pthread_mutex_timedlock)* lock_until, pthread_mutex_t* mutex,
               const timespec& deadline) {
  // Not trylock, which leaves a lock that was made useless locked for ever (C library 2.36, 2.41).
  const timespec past{};
  int result = take_over(lock_until(mutex, &past), mutex);
  if (result != ETIMEDOUT) return result;
  // If the holder was stopped the last time, the next message does not wait for 50 ms again.
  if (stopped.drop(mutex) && is_holder_stopped(*mutex)) {
    stopped.add(mutex);
    return give_up(mutex);
  }
  do {
    const timespec look = to_timespec(now_ns() + kPatienceWithStopped_ns);
    result = take_over(lock_until(mutex, &look), mutex);
    if (result != ETIMEDOUT) return result;
    if (is_holder_stopped(*mutex)) {
      stopped.add(mutex);
      return give_up(mutex);
    }
  } while (now_ns() < to_ns(deadline) || is_of_shared_data(mutex));
  return ETIMEDOUT;
}

int post(sem_t* semaphore) noexcept {
  static const auto next = find_next(&sem_post, "sem_post");
  return next(semaphore);
}

void release() noexcept {
  if (waking.locks > 0) --waking.locks;  // 0: taken by a function that is not ours
  if (waking.locks > 0) return;
  const std::size_t count = waking.count.exchange(0, std::memory_order_relaxed);
  for (std::size_t i = 0; i < count; ++i) post(waking.semaphores[i]);
}

[[maybe_unused]] const bool is_linked = can_share_data = true;

}  // namespace
}  // namespace sls::bus

// The dynamic linker gives Fast DDS these functions instead of those of the C library. Except for
// unlocking, Fast DDS uses them only for locks between processes (boost::interprocess with a time
// limit). Locks between its own threads use other functions and do not get slower.

int pthread_mutexattr_setpshared(pthread_mutexattr_t* attributes, int shared) noexcept {
  static const auto next =
      sls::bus::find_next(&pthread_mutexattr_setpshared, "pthread_mutexattr_setpshared");
  const int result = next(attributes, shared);
  if (result != 0 || shared != PTHREAD_PROCESS_SHARED) return result;
  return pthread_mutexattr_setrobust(attributes, PTHREAD_MUTEX_ROBUST);
}

int pthread_mutex_timedlock(pthread_mutex_t* mutex, const timespec* deadline) noexcept {
  using namespace sls::bus;
  static const auto next = find_next(&pthread_mutex_timedlock, "pthread_mutex_timedlock");
  const bool is_next_own = own_locks_to_come > 0;
  if (is_next_own) --own_locks_to_come;
  if ((mutex->__data.__kind & kRobustBit) == 0) return next(mutex, deadline);
  if (is_next_own) remember_as_own(mutex);
  if (mutex == held) {
    is_held_twice = true;
    return 0;
  }
  const int result = is_own(mutex) ? lock_own(next, mutex) : lock_other(next, mutex, *deadline);
  if (result == 0 && !forgone.hold(mutex)) {
    held = mutex;
    ++waking.locks;
  }
  return result;
}

int pthread_mutex_unlock(pthread_mutex_t* mutex) noexcept {
  using namespace sls::bus;
  static const auto next = find_next(&pthread_mutex_unlock, "pthread_mutex_unlock");
  if ((mutex->__data.__kind & kRobustBit) == 0) return next(mutex);  // of this process
  if (forgone.drop(mutex)) return 0;
  if (mutex == held) {
    if (std::exchange(is_held_twice, false)) return 0;
    held = nullptr;
  }
  const int result = next(mutex);
  release();
  // EPERM: this process went on without the lock. boost::interprocess would end the process.
  return result == EPERM && is_leaving.load(std::memory_order_relaxed) ? 0 : result;
}

int sem_post(sem_t* semaphore) noexcept {
  using namespace sls::bus;
  if (waking.locks == 0) return post(semaphore);
  // A signal handler may post between any two instructions of this function.
  const std::size_t place = waking.count.fetch_add(1, std::memory_order_relaxed);
  if (place < waking.semaphores.size()) {
    waking.semaphores[place] = semaphore;
    return 0;
  }
  waking.count.fetch_sub(1, std::memory_order_relaxed);
  return post(semaphore);
}

int sem_timedwait(sem_t* semaphore, const timespec* deadline) {
  using namespace sls::bus;
  static const auto next = find_next(&sem_timedwait, "sem_timedwait");
  if (!is_of_port(semaphore)) return next(semaphore, deadline);
  own_locks_to_come = 2;
  return wait_for_message(semaphore, limit(*deadline, kLook_ns));
}

// Fast DDS waits so for shared data alone.
int sem_wait(sem_t* semaphore) {
  using namespace sls::bus;
  static const auto next = find_next(&sem_wait, "sem_wait");
  thread_local const sem_t* known = nullptr;
  if (semaphore != known && !is_of_shared_data(semaphore)) return next(semaphore);
  known = semaphore;
  wait_for_message(semaphore, to_timespec(now_ns() + kLook_ns));
  return 0;  // woken without a message, the reader looks for one
}
