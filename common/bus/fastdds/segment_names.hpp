/// Names of the middleware's files in /dev/shm.
#pragma once

#include <cstddef>
#include <string_view>

#include "fastdds_files.hpp"

namespace sls::bus {

/// True for the name of a participant's segment: the prefix and sixteen hexadecimal digits.
inline bool is_segment(std::string_view name) {
  constexpr std::string_view kBegin = kSharedMemoryPrefix;
  constexpr std::size_t kDigits = 16;
  return name.size() == kBegin.size() + kDigits && name.substr(0, kBegin.size()) == kBegin &&
         name.find_first_not_of("0123456789abcdef", kBegin.size()) == name.npos;
}

}  // namespace sls::bus
