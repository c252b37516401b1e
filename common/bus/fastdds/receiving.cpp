/// Replaces `recvfrom` of the C library in the programs that link this file (sim_server,
/// control_client, recorder). If `is_spinning` (common/bus/spinning.hpp), a thread that waits for a
/// datagram polls for it before it sleeps. shared_locks.cpp does the same for the semaphores of
/// shared memory.
///
/// Upstream: none reported. To be deleted when a transport of Fast DDS can spin.
#include <dlfcn.h>
#include <sys/socket.h>

#include <cerrno>

#include "common/bus/fastdds/adaptive_spin.hpp"
#include "common/bus/spinning.hpp"

ssize_t recvfrom(int socket, void* buffer, std::size_t length, int flags, sockaddr* sender,
                 socklen_t* sender_length) {
  static const auto next = reinterpret_cast<decltype(&recvfrom)>(dlsym(RTLD_NEXT, "recvfrom"));
  thread_local sls::bus::AdaptiveSpin spin(1);  // each poll is a system call
  const bool waits = (flags & MSG_DONTWAIT) == 0;
  if (waits && sls::bus::is_spinning.load(std::memory_order_relaxed)) {
    ssize_t received = 0;
    const socklen_t room = sender_length ? *sender_length : 0;
    const bool is_there = spin.wait_for([&] {
      if (sender_length) *sender_length = room;
      received = next(socket, buffer, length, flags | MSG_DONTWAIT, sender, sender_length);
      return received >= 0 || (errno != EAGAIN && errno != EWOULDBLOCK);
    });
    if (is_there) return received;
    if (sender_length) *sender_length = room;
  }
  return next(socket, buffer, length, flags, sender, sender_length);
}
