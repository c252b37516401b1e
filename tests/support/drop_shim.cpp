/// LD_PRELOAD library that drops IPv4 datagrams: SLS_DROP_PERCENT % of those that the process sends
/// and SLS_DROP_RECEIVED_PERCENT % of those that it receives. A generator seeded with SLS_DROP_SEED
/// selects them. If SLS_DROP_WHILE names a file, it drops only while that file exists. A send call
/// of a dropped datagram returns success, as on a real network. When the process ends, the library
/// prints the number of dropped datagrams. A test that is linked with it sets the share by itself.
#include <dlfcn.h>
#include <sys/socket.h>
#include <sys/types.h>
#include <unistd.h>

#include <atomic>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <mutex>
#include <random>

namespace {

std::atomic<std::uint64_t> passed{0}, lost{0};

double read_environment(const char* name) {
  const char* text = std::getenv(name);
  return text ? std::strtod(text, nullptr) : 0.0;
}

}  // namespace

namespace sls::test {
std::atomic<double> drop_percent{read_environment("SLS_DROP_PERCENT")};  // of those that are sent
}  // namespace sls::test

namespace {

bool is_lost(int socket, double percent) {
  int type = 0, domain = 0;
  socklen_t size = sizeof type;
  if (getsockopt(socket, SOL_SOCKET, SO_TYPE, &type, &size) != 0 || type != SOCK_DGRAM)
    return false;
  size = sizeof domain;
  if (getsockopt(socket, SOL_SOCKET, SO_DOMAIN, &domain, &size) != 0 || domain != AF_INET)
    return false;
  static const char* const condition = std::getenv("SLS_DROP_WHILE");
  if (condition && access(condition, F_OK) != 0) return false;
  static std::mt19937_64 generator(static_cast<std::uint64_t>(read_environment("SLS_DROP_SEED")));
  static std::mutex mutex;
  const std::lock_guard lock(mutex);
  ++passed;
  if (std::uniform_real_distribution<double>(0, 100)(generator) >= percent) return false;
  ++lost;
  return true;
}

bool is_lost_on_sending(int socket) {
  return sls::test::drop_percent > 0 && is_lost(socket, sls::test::drop_percent);
}

template <class Function>
Function find_original(const char* name) {
  return reinterpret_cast<Function>(dlsym(RTLD_NEXT, name));
}

void report() {
  std::fprintf(stderr, "drop_shim: lost %llu of %llu datagrams\n",
               static_cast<unsigned long long>(lost), static_cast<unsigned long long>(passed));
}

/// Reports when the process ends, in either way (common/bus/end_process.hpp).
[[maybe_unused]] const bool reports = std::atexit(report) == 0 && std::at_quick_exit(report) == 0;

}  // namespace

extern "C" ssize_t sendmsg(int socket, const msghdr* message, int flags) {
  static const auto original = find_original<ssize_t (*)(int, const msghdr*, int)>("sendmsg");
  if (!is_lost_on_sending(socket)) return original(socket, message, flags);
  std::size_t bytes = 0;
  for (std::size_t i = 0; i < message->msg_iovlen; ++i) bytes += message->msg_iov[i].iov_len;
  return static_cast<ssize_t>(bytes);
}

extern "C" ssize_t sendto(int socket, const void* data, std::size_t bytes, int flags,
                          const sockaddr* to, socklen_t size) {
  static const auto original =
      find_original<ssize_t (*)(int, const void*, std::size_t, int, const sockaddr*, socklen_t)>(
          "sendto");
  if (!is_lost_on_sending(socket)) return original(socket, data, bytes, flags, to, size);
  return static_cast<ssize_t>(bytes);
}

extern "C" ssize_t recvfrom(int socket, void* data, std::size_t bytes, int flags, sockaddr* from,
                            socklen_t* size) {
  static const auto original =
      find_original<ssize_t (*)(int, void*, std::size_t, int, sockaddr*, socklen_t*)>("recvfrom");
  static const double percent = read_environment("SLS_DROP_RECEIVED_PERCENT");
  const socklen_t room = size ? *size : 0;
  while (true) {
    const ssize_t count = original(socket, data, bytes, flags, from, size);
    if (count < 0 || percent == 0.0 || !is_lost(socket, percent)) return count;
    if (size) *size = room;
  }
}
