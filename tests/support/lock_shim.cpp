/// LD_PRELOAD library that ends or stops a process while it holds a lock that it shares with other
/// processes. After SLS_LOCK_COUNT unlocks of shared locks, the process sends itself
/// SLS_LOCK_SIGNAL just before the next unlock of a lock of a shared-memory port, or of the
/// notification of a reader that shares data, that fits all variables:
/// - SLS_LOCK_OF: the beginning of the file's name;
/// - SLS_LOCK_PORT: `own` for one that this process reads, `other` for one of another process;
/// - SLS_LOCK_KIND: `messages` for the lock over the messages, `waiters` for the lock over the
///   waiting readers.
#include <dlfcn.h>
#include <pthread.h>
#include <signal.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <mutex>
#include <optional>
#include <set>
#include <string>

namespace {

constexpr int kSharedBit = 128;  // in `__kind` of a glibc mutex

/// The file whose mapping holds the address; empty if there is none.
std::string find_file(const void* address) {
  const auto wanted = reinterpret_cast<std::uintptr_t>(address);
  std::ifstream maps("/proc/self/maps");
  for (std::string line; std::getline(maps, line);) {
    std::uintptr_t begin = 0, end = 0;
    if (std::sscanf(line.c_str(), "%lx-%lx", &begin, &end) == 2 && begin <= wanted &&
        wanted < end) {
      const auto path = line.find('/');
      return path == std::string::npos ? "" : line.substr(path);
    }
  }
  return "";
}

/// True if this process reads the port or notification: it has the file of its lock open.
bool is_read_here(const std::string& port) {
  for (const auto& entry : std::filesystem::directory_iterator("/proc/self/fd")) {
    std::error_code gone;
    const auto file = std::filesystem::read_symlink(entry.path(), gone);
    if (file == port + "_el" || file == port) return true;
  }
  return false;
}

/// True for the lock over a port's messages, false for the lock over its waiting readers, which has
/// the lower address. Empty until both locks of the port have been seen.
std::optional<bool> is_over_messages(const std::string& port, const pthread_mutex_t* lock) {
  static std::mutex mutex;
  static std::map<std::string, std::set<const pthread_mutex_t*>> seen;
  const std::lock_guard guard(mutex);
  auto& locks = seen[port];
  locks.insert(lock);
  if (locks.size() < 2) return std::nullopt;
  return lock == *locks.rbegin();
}

bool is_moment(const pthread_mutex_t* lock) {
  static const bool is_own_wanted = std::getenv("SLS_LOCK_PORT") == std::string("own");
  static const bool are_messages_wanted = std::getenv("SLS_LOCK_KIND") == std::string("messages");
  static const long count = std::atol(std::getenv("SLS_LOCK_COUNT"));
  static std::atomic<long> given_back{0};
  static std::atomic<bool> is_over{false};
  if (++given_back <= count || is_over) return false;
  const std::string file = find_file(lock);
  static const std::string wanted = std::string("/") + std::getenv("SLS_LOCK_OF");
  if (file.find(wanted) == std::string::npos || is_read_here(file) != is_own_wanted) return false;
  return is_over_messages(file, lock) == are_messages_wanted && !is_over.exchange(true);
}

// The signal stops all threads. Only the thread that sends it may hold a lock: otherwise a lock of
// another port would stay held, too.
std::atomic<int> threads_inside{0};  // that hold or wait for a shared lock
std::atomic<bool> is_stopping{false};
thread_local int locks_here = 0;

bool is_shared(const pthread_mutex_t* mutex) { return mutex->__data.__kind & kSharedBit; }

/// Takes a shared lock by `take`; first waits while the process is about to stop.
template <class Take>
int lock_shared(const Take& take) {
  if (locks_here > 0) {
    const int result = take();
    if (result == 0 || result == EOWNERDEAD) ++locks_here;
    return result;
  }
  ++threads_inside;
  while (is_stopping) {
    --threads_inside;
    usleep(1000);
    ++threads_inside;
  }
  const int result = take();
  if (result == 0 || result == EOWNERDEAD)
    ++locks_here;
  else
    --threads_inside;
  return result;
}

void send_signal() {
  is_stopping = true;
  for (int i = 0; i < 1000 && threads_inside > 1; ++i) usleep(1000);
  raise(std::atoi(std::getenv("SLS_LOCK_SIGNAL")));
  is_stopping = false;
}

template <class Function>
Function* find_next(Function*, const char* name) {
  return reinterpret_cast<Function*>(dlsym(RTLD_NEXT, name));
}

}  // namespace

extern "C" int pthread_mutex_trylock(pthread_mutex_t* mutex) noexcept {
  static const auto next = find_next(&pthread_mutex_trylock, "pthread_mutex_trylock");
  return is_shared(mutex) ? lock_shared([&] { return next(mutex); }) : next(mutex);
}

extern "C" int pthread_mutex_timedlock(pthread_mutex_t* mutex, const timespec* deadline) noexcept {
  static const auto next = find_next(&pthread_mutex_timedlock, "pthread_mutex_timedlock");
  return is_shared(mutex) ? lock_shared([&] { return next(mutex, deadline); })
                          : next(mutex, deadline);
}

extern "C" int pthread_mutex_unlock(pthread_mutex_t* mutex) noexcept {
  static const auto next = find_next(&pthread_mutex_unlock, "pthread_mutex_unlock");
  if (!is_shared(mutex)) return next(mutex);
  if (is_moment(mutex)) send_signal();
  const int result = next(mutex);
  if (locks_here > 0 && --locks_here == 0) --threads_inside;
  return result;
}
