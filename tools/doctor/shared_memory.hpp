/// The content of /dev/shm: free space and segments with their owners. Removes nothing.
#pragma once

#include <sys/types.h>

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace sls::doctor {

struct SharedMemory {
  bool is_there = false;                  ///< exists, and this process may write there
  std::uint64_t size = 0;                 ///< bytes
  std::uint64_t free = 0;                 ///< bytes
  int stale_segments = 0;                 ///< left by processes that were killed
  std::uint64_t stale_size = 0;           ///< bytes
  std::vector<std::string> stale_owners;  ///< user names, each once
  std::vector<std::uint32_t> read_ports;  ///< ports that running processes read
};

SharedMemory survey_shared_memory(const std::filesystem::path& folder = "/dev/shm");

}  // namespace sls::doctor
