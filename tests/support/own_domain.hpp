#pragma once

#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <cstddef>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <system_error>

#include "fastdds_files.hpp"
#include "tests/support/waiting.hpp"

namespace sls::test {

/// A DDS domain (1 to 60) that no other test of this run uses at the same time. A lock reserves it,
/// which the kernel releases with the process.
class OwnDomain {
 public:
  OwnDomain();
  ~OwnDomain();
  OwnDomain(const OwnDomain&) = delete;
  OwnDomain& operator=(const OwnDomain&) = delete;
  int number() const { return number_; }
  std::string text() const { return std::to_string(number_); }

 private:
  int number_ = 0;
  int lock_ = -1;
};

/// The domain of this process, for tests that need only one.
inline int own_domain() {
  static const OwnDomain domain;
  return domain.number();
}

inline OwnDomain::OwnDomain() {
  // A name in the abstract socket namespace is a lock that leaves nothing behind.
  const bool found = wait_until([this] {
    for (number_ = 1; number_ <= 60; ++number_) {
      sockaddr_un address{};
      address.sun_family = AF_UNIX;
      const std::string name = "sls-test-domain-" + std::to_string(number_);
      std::copy(name.begin(), name.end(), address.sun_path + 1);
      const auto size = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + 1 + name.size());
      lock_ = socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0);
      if (lock_ < 0) throw std::runtime_error("socket");
      if (bind(lock_, reinterpret_cast<const sockaddr*>(&address), size) == 0) return true;
      close(lock_);
    }
    return false;
  });
  if (!found) throw std::runtime_error("no free DDS domain among 1 to 60");
}

inline OwnDomain::~OwnDomain() {
  // The shared-memory ports of domain N, from 7400 + 250 N on, outlive processes that were killed.
  const std::string prefix = std::string(bus::kSharedMemoryPrefix) + "port";
  for (const auto& file : std::filesystem::directory_iterator("/dev/shm")) {
    const std::string name = file.path().filename();
    const std::size_t place = name.find(prefix);
    if (place == name.npos) continue;
    const long port = std::strtol(name.c_str() + place + prefix.size(), nullptr, 10) & 0xffff;
    std::error_code ignored;
    if (port >= 7400 + 250 * number_ && port < 7400 + 250 * (number_ + 1))
      std::filesystem::remove(file.path(), ignored);
  }
  close(lock_);
}

}  // namespace sls::test
