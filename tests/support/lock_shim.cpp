/// LD_PRELOAD library that ends or stops a process in the middle of a lock that it shares with
/// others. After it has given back SLS_LOCK_COUNT of them, it sends itself SLS_LOCK_SIGNAL instead
/// of giving back the next one of a shared-memory port
/// - that it reads, with SLS_LOCK_PORT=own, or that another process reads, with other;
/// - over the port's messages with SLS_LOCK_KIND=messages, over who waits for them with waiters.
#include <dlfcn.h>
#include <pthread.h>
#include <signal.h>

#include <atomic>
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

constexpr int kSharedBit = 128;  // of the kind of a mutex of glibc

/// The file whose mapping holds the address; empty where there is none.
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

/// True where this process has the file open by which the reader of the port excludes others.
bool is_read_here(const std::string& port) {
  for (const auto& entry : std::filesystem::directory_iterator("/proc/self/fd")) {
    std::error_code gone;
    if (std::filesystem::read_symlink(entry.path(), gone) == port + "_el") return true;
  }
  return false;
}

/// True for the lock over a port's messages, false for that over who waits, which stands before it;
/// of ports of which one was seen yet, nobody knows.
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
  if (file.find("/fastrtps_port") == std::string::npos || is_read_here(file) != is_own_wanted)
    return false;
  return is_over_messages(file, lock) == are_messages_wanted && !is_over.exchange(true);
}

}  // namespace

extern "C" int pthread_mutex_unlock(pthread_mutex_t* mutex) noexcept {
  static const auto next =
      reinterpret_cast<decltype(&pthread_mutex_unlock)>(dlsym(RTLD_NEXT, "pthread_mutex_unlock"));
  if ((mutex->__data.__kind & kSharedBit) && is_moment(mutex))
    raise(std::atoi(std::getenv("SLS_LOCK_SIGNAL")));
  return next(mutex);
}
