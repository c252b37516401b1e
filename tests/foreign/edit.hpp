#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>

#include "fastdds_types.hpp"

namespace sls::foreign {

/// A change of a message's bytes: inserts `count` bytes at `offset`, or removes them if negative.
struct Edit {
  std::size_t offset = 0;
  int count = 0;
};
constexpr std::size_t kEnd = SIZE_MAX;
constexpr std::uint32_t kMostAdded = 16;

inline bool apply(const Edit& edit, bus::rtps::SerializedPayload_t& payload) {
  const std::size_t offset = std::min<std::size_t>(edit.offset, payload.length);
  char* const begin = reinterpret_cast<char*>(payload.data) + offset;
  const std::size_t rest = payload.length - offset;
  if (edit.count >= 0) {
    std::memmove(begin + edit.count, begin, rest);
    std::memset(begin, 0, static_cast<std::size_t>(edit.count));
  } else {
    std::memmove(begin, begin - edit.count, rest + edit.count);
  }
  payload.length = static_cast<std::uint32_t>(static_cast<int>(payload.length) + edit.count);
  return true;
}

}  // namespace sls::foreign
