#include "tools/doctor/shared_memory.hpp"

#include <sys/stat.h>
#include <sys/statvfs.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <system_error>

#include "common/bus/environment.hpp"
#include "common/bus/fastdds/stale_segments.hpp"
#include "fastdds_files.hpp"

namespace sls::doctor {
SharedMemory survey_shared_memory(const std::filesystem::path& folder) {
  SharedMemory found;
  struct statvfs room {};
  if (::statvfs(folder.c_str(), &room) != 0 || !bus::find_shared_memory_defect(folder).empty())
    return found;
  found.is_there = true;
  found.size = static_cast<std::uint64_t>(room.f_blocks) * room.f_frsize;
  found.free = static_cast<std::uint64_t>(room.f_bavail) * room.f_frsize;
  for (const auto& segment : bus::find_stale_segments(folder)) {
    ++found.stale_segments;
    struct stat status {};
    if (::stat(segment.c_str(), &status) != 0) continue;
    constexpr std::uint64_t kBlock = 512;  // unit of st_blocks on every file system
    found.stale_size += static_cast<std::uint64_t>(status.st_blocks) * kBlock;
    const std::string owner = bus::name_user(status.st_uid);
    auto& owners = found.stale_owners;
    if (std::find(owners.begin(), owners.end(), owner) == owners.end()) owners.push_back(owner);
  }
  const std::string kPortLock = std::string(bus::kSharedMemoryPrefix) + "port%u_el%n";
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator(folder, error)) {
    std::uint32_t port = 0;
    int length = 0;
    const std::string name = entry.path().filename();
    if (std::sscanf(name.c_str(), kPortLock.c_str(), &port, &length) != 1) continue;
    if (length != static_cast<int>(name.size())) continue;  // not the lock of a port
    if (bus::is_port_read(port, folder)) found.read_ports.push_back(port);
  }
  return found;
}

}  // namespace sls::doctor
